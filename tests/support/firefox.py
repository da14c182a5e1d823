"""Firefox ESR for Selenium, without geckodriver, which Debian does not have: Firefox speaks the commands of WebDriver itself (Marionette), over
a socket, in frames `<size>:[0, <number>, <command>, <parameters>]`. A server of HTTP in a thread of ours translates."""

import contextlib
import http.server
import json
import os
import re
import shutil
import socket
import subprocess
import tempfile
import threading
import unittest

# browser.py has added this folder to sys.path.
from ports import free_port
from waiting import wait_until

FIREFOX = "/usr/bin/firefox-esr"
PATIENCE = 30  # seconds
PREFERENCES = {"app.update.enabled": False, "browser.shell.checkDefaultBrowser": False, "datareporting.policy.dataSubmissionEnabled": False,
               "toolkit.telemetry.enabled": False, "browser.startup.homepage_override.mstone": "ignore", "network.captive-portal-service.enabled": False,
               "network.connectivity-service.enabled": False, "app.normandy.enabled": False, "extensions.update.enabled": False,
               "browser.safebrowsing.malware.enabled": False, "browser.safebrowsing.phishing.enabled": False, "services.settings.server": "",
               "network.proxy.type": 0, "webgl.force-enabled": True, "dom.disable_open_during_load": False}

# https://www.w3.org/TR/webdriver2/#endpoints, as far as the tests go: method, path below the session, Marionette's command. What is in
# braces in the path is a parameter.
COMMANDS = [(method, re.compile(re.sub(r"\{(\w+)\}", r"(?P<\1>[^/]+)", path) + "$"), f"WebDriver:{command}") for method, path, command in [
    ("POST", "/url", "Navigate"), ("GET", "/url", "GetCurrentURL"), ("GET", "/title", "GetTitle"), ("GET", "/source", "GetPageSource"),
    ("POST", "/back", "Back"), ("POST", "/forward", "Forward"), ("POST", "/refresh", "Refresh"), ("POST", "/timeouts", "SetTimeouts"),
    ("POST", "/element", "FindElement"), ("POST", "/elements", "FindElements"), ("GET", "/element/active", "GetActiveElement"),
    ("POST", "/element/{element}/element", "FindElement"), ("POST", "/element/{element}/elements", "FindElements"),
    ("POST", "/element/{id}/click", "ElementClick"), ("POST", "/element/{id}/clear", "ElementClear"), ("POST", "/element/{id}/value", "ElementSendKeys"),
    ("GET", "/element/{id}/text", "GetElementText"), ("GET", "/element/{id}/attribute/{name}", "GetElementAttribute"),
    ("GET", "/element/{id}/property/{name}", "GetElementProperty"), ("GET", "/element/{id}/css/{propertyName}", "GetElementCSSValue"),
    ("GET", "/element/{id}/rect", "GetElementRect"), ("GET", "/element/{id}/enabled", "IsElementEnabled"),
    ("GET", "/element/{id}/selected", "IsElementSelected"), ("GET", "/element/{id}/displayed", "IsElementDisplayed"),
    ("GET", "/element/{id}/screenshot", "TakeScreenshot"), ("POST", "/execute/sync", "ExecuteScript"), ("POST", "/execute/async", "ExecuteAsyncScript"),
    ("GET", "/screenshot", "TakeScreenshot"), ("POST", "/actions", "PerformActions"), ("DELETE", "/actions", "ReleaseActions"),
    ("GET", "/window", "GetWindowHandle"), ("GET", "/window/handles", "GetWindowHandles"), ("POST", "/window", "SwitchToWindow"),
    ("POST", "/window/new", "NewWindow"), ("DELETE", "/window", "CloseWindow"), ("GET", "/window/rect", "GetWindowRect"),
    ("POST", "/window/rect", "SetWindowRect"), ("POST", "/frame", "SwitchToFrame"), ("POST", "/frame/parent", "SwitchToParentFrame"),
    ("POST", "/alert/accept", "AcceptAlert"), ("POST", "/alert/dismiss", "DismissAlert"), ("GET", "/cookie", "GetCookies"),
    ("POST", "/cookie", "AddCookie"), ("DELETE", "/cookie", "DeleteAllCookies")]]

# In a sandbox with the page's own rights, to which its Content-Security-Policy does not apply.
RUN_FIRST = """Services.obs.addObserver((window) => {
  if (/^https?:$/.test(window.location.protocol))
    Cu.evalInSandbox(%s, new Cu.Sandbox(window, {sandboxPrototype: window, wantXrays: false}));
}, "content-document-global-created");"""


class Marionette:
    """The connection to a Firefox that runs: a command, and its answer."""

    def __init__(self, port):
        def connect():
            with contextlib.suppress(ConnectionRefusedError):
                return socket.create_connection(("127.0.0.1", port), PATIENCE)
        self.socket = wait_until(connect, "Firefox does not listen")
        self.socket.settimeout(4 * PATIENCE)
        self.received = b""
        self.number = 0
        self.read()  # its greeting

    def read(self):
        while b":" not in self.received[:20]:
            self.receive()
        size, _, rest = self.received.partition(b":")
        self.received = rest
        while len(self.received) < int(size):
            self.receive()
        message, self.received = self.received[:int(size)], self.received[int(size):]
        return json.loads(message)

    def receive(self):
        data = self.socket.recv(65536)
        if not data:
            raise ConnectionError("Firefox has gone")
        self.received += data

    def call(self, command, parameters):
        """Its error, or None, and its result."""
        self.number += 1
        text = json.dumps([0, self.number, command, parameters]).encode()
        self.socket.sendall(b"%d:%s" % (len(text), text))
        _, _, error, result = self.read()
        return error, result

    def run(self, script, *arguments):
        """Runs a script that may do all that Firefox can."""
        for command, parameters in (("Marionette:SetContext", {"value": "chrome"}),
                                    ("WebDriver:ExecuteScript", {"script": script, "args": arguments}),
                                    ("Marionette:SetContext", {"value": "content"})):
            error, _ = self.call(command, parameters)
            if error:
                raise OSError(f"{command}: {error}")

    def set_preference(self, name, value):
        self.run(f"Services.prefs.set{'Bool' if isinstance(value, bool) else 'Int'}Pref(...arguments)", name, value)

    def run_first(self, script):
        """Runs it in every page from now on, before the page's own scripts."""
        self.run("Services.ppmm.loadProcessScript('data:application/javascript;charset=utf-8,' + encodeURIComponent(arguments[0]), true)",
                 RUN_FIRST % json.dumps(script))


class Translator(http.server.BaseHTTPRequestHandler):
    """What Selenium asks by HTTP, as commands of Marionette."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self):
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        parameters = json.loads(body) if body else {}
        with self.server.turn:
            status, value = self.translate(parameters)
        text = json.dumps({"value": value}).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json; charset=utf-8")
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)

    do_GET = do_POST = do_DELETE = answer

    def translate(self, parameters):
        path = re.sub("^/session(/[^/]+)?", "", self.path)
        if path == "" and self.command == "POST":
            error, result = self.server.firefox.call("WebDriver:NewSession", parameters.get("capabilities", {}).get("alwaysMatch", {}))
            return self.told(error, result)
        if path == "" and self.command == "DELETE":
            return 200, None  # whoever opened the browser ends it
        for method, pattern, command in COMMANDS:
            if method == self.command and (match := pattern.match(path)):
                parameters.update(match.groupdict())
                if command == "WebDriver:TakeScreenshot":
                    parameters["full"] = False
                if command == "WebDriver:SwitchToFrame" and isinstance(parameters.get("id"), dict):
                    parameters["element"] = next(iter(parameters.pop("id").values()))
                error, result = self.server.firefox.call(command, parameters)
                whole = command in ("WebDriver:GetElementRect", "WebDriver:GetWindowRect", "WebDriver:SetWindowRect", "WebDriver:NewWindow")
                return self.told(error, result if whole or not isinstance(result, dict) or set(result) != {"value"} else result["value"])
        return 404, {"error": "unknown command", "message": f"{self.command} {self.path}", "stacktrace": ""}

    @staticmethod
    def told(error, result):
        if error:
            return 500, {"error": error["error"], "message": error["message"], "stacktrace": error.get("stacktrace", "")}
        return 200, result


@contextlib.contextmanager
def open_firefox(webdriver, trusting=False, loads="normal", hosts=()):
    """Yields a Selenium driver, which has the methods `set_preference(name, value)` and `run_first(script)` besides. `hosts`: names that lead to this machine."""
    if not os.access(FIREFOX, os.X_OK):
        raise unittest.SkipTest(f"{FIREFOX} is missing (package firefox-esr)")
    profile = tempfile.mkdtemp(prefix="webots_cloud_firefox_")
    port = free_port()
    with open(os.path.join(profile, "user.js"), "w") as file:
        for name, value in {**PREFERENCES, "marionette.port": port, "network.dns.localDomains": ",".join(hosts)}.items():
            file.write(f"user_pref({json.dumps(name)}, {json.dumps(value)});\n")
    environment = {**os.environ, "HOME": profile, "MOZ_CRASHREPORTER_DISABLE": "1"}
    browser = subprocess.Popen([FIREFOX, "--headless", "--marionette", "--remote-allow-system-access", "--no-remote", "--profile", profile,
                                "about:blank"], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Translator)
    server.turn = threading.Lock()
    try:
        server.firefox = Marionette(port)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        options = webdriver.FirefoxOptions()
        options.accept_insecure_certs = trusting
        options.page_load_strategy = loads
        driver = webdriver.Remote(command_executor=f"http://127.0.0.1:{server.server_address[1]}", options=options)
        driver.set_script_timeout(PATIENCE)
        driver.set_page_load_timeout(PATIENCE)
        driver.set_preference = server.firefox.set_preference
        driver.run_first = server.firefox.run_first
        try:
            yield driver
        finally:
            driver.command_executor.close()
            server.shutdown()
            server.firefox.socket.close()
    finally:
        server.server_close()
        browser.terminate()
        try:
            browser.wait(10)
        except subprocess.TimeoutExpired:
            browser.kill()
            browser.wait()
        shutil.rmtree(profile, ignore_errors=True)
