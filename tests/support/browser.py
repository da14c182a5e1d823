"""Headless Chromium for tests, or Firefox where WEBOTS_CLOUD_BROWSER is `firefox`: one place for their start-up options."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.append(os.path.dirname(os.path.abspath(__file__)))
from firefox import open_firefox  # noqa: E402
from waiting import wait_until  # noqa: E402

BROWSER = os.environ.get("WEBOTS_CLOUD_BROWSER", "chromium")
DRIVER = "/usr/bin/chromedriver"
CHROMIUM = "/usr/bin/chromium"
SHELL = "/usr/lib/chromium/chromium-headless-shell"  # Chromium without windows and services: the same pages for a third of the processor time
AXE = os.path.join(os.path.dirname(__file__), "../../build/node/tests/viewer/node_modules/axe-core/axe.min.js")

ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",  # Chromium's own sandbox refuses to start as root.
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--hide-scrollbars",
    "--no-proxy-server",
)


@contextlib.contextmanager
def open_browser(width, height, dark=False, trusting=False, loads="normal", hosts=(), whole=False, more=()):
    """Yields a Selenium driver whose page is exactly width x height CSS pixels; raises SkipTest without Chromium.
    `trusting`: certificates that nobody vouches for are good enough. `loads`: "none" lets tests look at pages that are still being loaded.
    `hosts`: names that lead to this machine. `whole`: all of Chromium, also where its shell is installed: for what browsers do besides
    showing pages. `more`: further arguments of Chromium.

    The profile is new and is removed afterwards; leaving the context ends Chromium and its driver.
    """
    webdriver, service_class = _selenium()
    if BROWSER == "firefox":
        with open_firefox(webdriver, trusting, loads, hosts) as driver:
            _make_firefox_complete(driver)
            resize(driver, width, height)
            prefer_dark(driver, dark)
            yield driver
        return
    for program in (CHROMIUM, DRIVER):
        if not os.access(program, os.X_OK):
            raise unittest.SkipTest(f"{program} is missing (packages chromium and chromium-driver)")
    profile = tempfile.mkdtemp(prefix="webots_cloud_browser_")
    start = _start_chromium if whole or not os.access(SHELL, os.X_OK) else _start_shell
    try:
        with start(webdriver, service_class(DRIVER), profile, _options(webdriver, trusting, loads), [*_arguments(profile, hosts), *more]) as driver:
            driver.set_script_timeout(30)
            driver.set_page_load_timeout(30)
            resize(driver, width, height)
            prefer_dark(driver, dark)
            _load_whole(driver)
            yield driver
    finally:
        shutil.rmtree(profile, ignore_errors=True)


def _make_firefox_complete(driver):
    """What only Chromium's protocol has: there is no log of the console, and what needs that protocol skips its test."""
    def refuse(command, *_):
        raise unittest.SkipTest(f"{command} is a command of Chromium alone")
    driver.execute_cdp_cmd = refuse
    driver.get_log = lambda kind: []


def resize(driver, width, height):
    """Sets the size of the page. (A window's own size includes its frame and has a minimum of about 500 pixels.)"""
    if BROWSER == "firefox":
        for _ in range(2):  # the second time the frame is known
            frame = driver.execute_script("return [outerWidth - innerWidth, outerHeight - innerHeight]")
            driver.set_window_size(width + frame[0], height + frame[1])
        return
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def run_first(driver, script):
    """Runs it in every page from now on, before the page's own scripts."""
    if BROWSER == "firefox":
        return driver.run_first(script)
    driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})


def disable_scripts(driver):
    """In pages that are opened from now on."""
    if BROWSER == "firefox":
        return driver.set_preference("javascript.enabled", False)
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})


def screenshot(driver, path):
    """Writes the visible page to a PNG file, creating its folder."""
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    if not driver.save_screenshot(path):
        raise OSError(f"cannot write the screenshot {path}")


def accessibility_findings(driver):
    """What axe-core has to say against the page as it is, in light and dark: a list of sentences. Null: test.sh did not install it."""
    if not os.path.isfile(AXE):
        return None
    with open(AXE, encoding="utf-8") as file:
        driver.execute_script(file.read())
    found = []
    for dark in (False, True):
        prefer_dark(driver, dark)
        # Without copies of style sheets of other hosts, which it would put into the page, whose policy forbids that.
        violations = driver.execute_async_script("axe.run({preload: false}).then(({violations}) => arguments[0](violations))")
        found += [f"{rule['id']}: {rule['help']}: {node['html'][:200]} {node.get('failureSummary', '')}" for rule in violations for node in rule["nodes"]]
    prefer_dark(driver, False)
    return found


def console_messages(driver, level=None):
    """Returns and forgets what the browser's console got: dicts with level (INFO, WARNING, SEVERE) and message."""
    return [entry for entry in driver.get_log("browser") if level is None or entry["level"] == level]


def _selenium():
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
    except ImportError as error:
        raise unittest.SkipTest(f"{error} (package python3-selenium)") from error
    return webdriver, Service


def _options(webdriver, trusting, loads):
    options = webdriver.ChromeOptions()
    options.accept_insecure_certs = trusting
    options.page_load_strategy = loads
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    options.ignore_local_proxy_environment_variables()
    return options


def _arguments(profile, hosts):
    rules = ",".join(f"MAP {host} 127.0.0.1" for host in hosts)
    return [*ARGUMENTS, *([f"--host-resolver-rules={rules}"] if hosts else []), f"--user-data-dir={profile}"]


@contextlib.contextmanager
def _start_chromium(webdriver, service, _, options, arguments):
    options.binary_location = CHROMIUM
    for argument in arguments:
        options.add_argument(argument)
    driver = webdriver.Chrome(service=service, options=options)
    try:
        yield driver
    finally:
        driver.quit()


@contextlib.contextmanager
def _start_shell(webdriver, service, profile, options, arguments):
    """The driver can't start the shell, only speak to one that runs, of which quit() closes no more than the page."""
    address = os.path.join(profile, "DevToolsActivePort")
    shell = subprocess.Popen([SHELL, *arguments, "--remote-debugging-port=0", "about:blank"], stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: os.path.exists(address) and os.path.getsize(address), "Chromium does not listen")
        with open(address, encoding="utf-8") as file:
            options.debugger_address = f"127.0.0.1:{file.readline().strip()}"
        driver = webdriver.Chrome(service=service, options=options)
        try:
            yield driver
        finally:
            driver.quit()
    finally:
        shell.terminate()
        shell.wait()


def _load_whole(driver):
    """Chromium drops what it is loading when a network interface of the machine comes or goes, as other tests make them do: then `get` loads
    the page once more."""
    dropped = "net::ERR_NETWORK_CHANGED"
    load, take, kept = driver.get, driver.get_log, []

    def shows_error():  # The shell's driver does not always say that it has nothing else to show.
        return driver.execute_script("return location.protocol") == "chrome-error:"

    def get(url):
        for attempts in range(10, 0, -1):
            try:
                load(url)
            except Exception as failure:  # Selenium's, which may not be installed
                if dropped not in str(failure) or attempts == 1:
                    raise
                continue
            said = take("browser")
            is_whole = not any(dropped in entry["message"] for entry in said) and not shows_error()
            if attempts == 1 or is_whole:
                kept.extend(said)
                return

    def get_log(kind):
        if kind != "browser":
            return take(kind)
        said = kept + take(kind)
        kept.clear()
        return said

    driver.get, driver.get_log = get, get_log


def prefer_dark(driver, dark):
    if BROWSER == "firefox":
        return driver.set_preference("layout.css.prefers-color-scheme.content-override", 0 if dark else 1)
    scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
