#!/usr/bin/python3
"""GET /metrics of both servers, and config/prometheus and config/grafana, which read it. Protocol section 13.7."""

import asyncio
import datetime
import email
import html
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser, server  # noqa: E402
from support.certificates import self_signed  # noqa: E402
from support.prometheus import FOLDER, Alertmanager, Prometheus, promtool  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

ROOT = os.path.join(os.path.dirname(__file__), "../..")
DASHBOARD = os.path.join(ROOT, "config/grafana/webots_cloud.json")
SERVERS = {"Both servers": {"session", "simulation"}, "The session server": {"session"}, "The simulation server": {"simulation"}}


def read(path):
    with open(path) as file:
        return file.read()


def certified(case):
    """The keys of a server with a certificate."""
    if not shutil.which("openssl"):
        case.skipTest("openssl is missing (package openssl)")
    folder = case.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_metrics_"))
    return dict(zip(("sslCertificate", "sslKey"), self_signed(folder, "DNS:localhost")))


def documented(server_kind):
    """The metrics that a server has, by name, with their types, as docs/metrics.md lists them."""
    sections = dict(section.split("\n", 1) for section in read(os.path.join(ROOT, "docs/metrics.md")).split("\n## ")[1:])
    return {name: kind for title, text in sections.items() if server_kind in SERVERS[title]
            for name, kind in re.findall(r"^\| `(\w+)`<br>[^|]* \| (\w+)", text, re.M)}


def announced(page):
    return dict(re.findall(r"^# TYPE (\w+) (\w+)$", page, re.M))


def dashboard_queries():
    return [(panel["title"], target["expr"]) for panel in json.loads(read(DASHBOARD))["panels"] for target in panel["targets"]]


class Names(unittest.TestCase):
    def test_promtool_finds_nothing_wrong_with_the_metrics_of_both_servers(self):
        self.assertIn('should not have "_sum" suffix', promtool("check", "metrics", text="# HELP x_sum X.\n# TYPE x_sum counter\nx_sum 1\n")[1])
        tls = certified(self)
        with SimulationServer(gateway=True, **tls) as simulation, SessionServer([simulation.address], relay=True, **tls) as session:
            for each in (simulation, session):
                self.assertEqual(promtool("check", "metrics", text=each.get("/metrics")), (True, ""), each.PROGRAM)

    def test_servers_have_the_metrics_that_are_documented_and_no_others(self):
        tls = certified(self)
        with SimulationServer(gateway=True, **tls) as simulation, SessionServer([simulation.address], relay=True, **tls) as session:
            self.assertEqual(announced(session.get("/metrics")), documented("session"))
            self.assertEqual(announced(simulation.get("/metrics")), documented("simulation"))

    def test_the_certificate_expires_when_openssl_says_so(self):
        tls = certified(self)
        told = subprocess.run(["openssl", "x509", "-noout", "-enddate", "-in", tls["sslCertificate"]], check=True, capture_output=True, text=True).stdout
        expires = datetime.datetime.strptime(told.strip(), "notAfter=%b %d %H:%M:%S %Y GMT").replace(tzinfo=datetime.timezone.utc)
        with SessionServer([], **tls) as session:
            self.assertIn(f"\nwebots_http_certificate_expiry_timestamp_seconds {expires.timestamp():.0f}\n", session.get("/metrics"))


class Rules(unittest.TestCase):
    def test_promtool_finds_nothing_wrong_with_the_configuration_and_the_rules_fire_when_they_should(self):
        for arguments in (("check", "config", "prometheus.yml"), ("test", "rules", "alerts_test.yml")):
            is_good, output = promtool(*arguments, folder=FOLDER)
            self.assertTrue(is_good, output)

    def test_every_rule_is_tested_on_an_alert_and_on_none(self):
        tested = read(os.path.join(FOLDER, "alerts_test.yml"))
        for alert in re.findall(r"- alert: (\w+)", read(os.path.join(FOLDER, "alerts.yml"))):
            self.assertRegex(tested, rf"alertname: {alert}\n +exp_alerts:", f"{alert}: an alert")
            self.assertIn(f"alertname: {alert}}}", tested, f"{alert}: none")

    def test_every_alert_is_explained(self):
        explained = re.findall(r"^\| `(Webots\w+)` \|", read(os.path.join(ROOT, "docs/monitoring.md")), re.M)
        self.assertEqual(explained, re.findall(r"- alert: (\w+)", read(os.path.join(FOLDER, "alerts.yml"))))

    def test_panels_of_the_dashboard_lie_beside_each_other(self):
        panels = json.loads(read(DASHBOARD))["panels"]
        self.assertEqual(sorted(panel["id"] for panel in panels), list(range(1, len(panels) + 1)))
        taken = set()
        for panel in panels:
            place = panel["gridPos"]
            cells = {(x, y) for x in range(place["x"], place["x"] + place["w"]) for y in range(place["y"], place["y"] + place["h"])}
            self.assertFalse(cells & taken, f"{panel['title']} covers another panel")
            self.assertLessEqual(place["x"] + place["w"], 24, panel["title"])
            taken |= cells


class Site(unittest.IsolatedAsyncioTestCase):
    """A session server with two machines, some starts, and a real Prometheus that sees them."""

    async def test_a_real_prometheus_answers_every_query_of_dashboard_and_alerts(self):
        with server() as first, server() as second, SessionServer([first.address, second.address], relay=True, **certified(self)) as session:
            wait_until(lambda: 'webots_servers{state="up"} 2' in session.get("/metrics"), "both machines are up")
            by_tls = f'["{session.address}"]\n    scheme: https\n    tls_config: {{insecure_skip_verify: true}}'
            with Prometheus({'["localhost:1999"]': by_tls, '"localhost:2000"': f'"{first.address}", "{second.address}"'}) as prometheus:
                self.seen = prometheus
                await self.wait_for('sum(up{job=~"webots_.*"}) == 3')
                await self.wait_for("count(webots_start_stage_seconds_count) == 6")
                async with Browser(session) as one, Browser(session) as other, Browser(session) as wrong:
                    for browser in (one, other):
                        await browser.start()
                        await browser.hear("webots:")
                    await wrong.start(url=WORLD.replace("arena", "nowhere"))
                    await wrong.hear("loading: Error:")
                    await self.wait_for('sum(webots_starts_total{result="ready"}) == 2')
                    await self.wait_for('sum(webots_starts_total{reason="not_found"}) >= 1')
                    await self.wait_for("sum(webots_machine_simulations) == 2")
                    for title, query in dashboard_queries():
                        await self.wait_for(query, title)
                    self.check_values()
                    await self.check_rules()

    async def wait_for(self, query, why=""):
        """Until it is answered with a number."""
        def is_answered():
            answer = self.seen.query(query)
            return answer and not all(math.isnan(value) for _, value in answer)
        await asyncio.to_thread(wait_until, is_answered, lambda: f"{why} {query} is answered {self.seen.query(query)}")

    def check_values(self):
        """The dashboard shows what has happened, by its own queries."""
        queries = {title: query for title, query in dashboard_queries()}
        self.assertEqual(len(self.seen.query(queries["Load by machine"])), 2)
        self.assertEqual({labels["stage"] for labels, _ in self.seen.query(queries["How long starts take: 9 of 10, at most"])}, {"fetch", "launch", "ready"})
        reasons = {labels["reason"]: value for labels, value in self.seen.query(queries["Starts that failed in 15 minutes, by reason"])}
        self.assertGreater(reasons.pop("not_found"), 0)
        self.assertEqual(set(reasons.values()), {0})

    async def check_rules(self):
        groups = (await asyncio.to_thread(self.seen.ask, "rules"))["groups"]
        rules = [rule for group in groups for rule in group["rules"]]
        self.assertEqual([rule["name"] for rule in rules], re.findall(r"- alert: (\w+)", read(os.path.join(FOLDER, "alerts.yml"))))
        for rule in rules:
            await asyncio.to_thread(wait_until, lambda name=rule["name"]: self.health(name) == "ok", f"{rule['name']} is evaluated")
            expected = "pending" if rule["name"] == "WebotsCertificateExpiring" else "inactive"  # that of the test has two days left
            self.assertEqual(rule["state"], expected, rule)
            selectors = re.findall(r"(?:webots_\w+|\bup\b)(?:\{[^}]*\})?", rule["query"])
            self.assertTrue(selectors, rule["query"])
            for selector in selectors:
                self.assertTrue(self.seen.query(selector), f"{rule['name']}: nothing is known of {selector}")

    def health(self, name):
        return next(rule["health"] for group in self.seen.ask("rules")["groups"] for rule in group["rules"] if rule["name"] == name)


class Mail(unittest.TestCase):
    @staticmethod
    def text_of(mail):
        parts = [part for part in email.message_from_bytes(mail.content).walk() if not part.is_multipart()]
        return html.unescape("".join(part.get_payload(decode=True).decode() for part in parts))

    def test_a_machine_that_falls_silent_is_a_mail_to_the_operator(self):
        try:
            from support.mailbox import CompletionQueue
        except ImportError as error:
            self.skipTest(f"{error} (package python3-aiosmtpd)")
        with CompletionQueue() as mailbox, Alertmanager(mailbox.port) as alertmanager, SimulationServer() as simulation:
            with SessionServer([simulation.address]) as session:
                changes = {"localhost:1999": session.address, "localhost:2000": simulation.address, "for: 2m": "for: 1s"}
                with Prometheus(changes, alertmanager) as prometheus:
                    wait_until(lambda: prometheus.query("webots_machine_up == 1"), "the machine is up")
                    simulation.stop()
                    sentence = f"The session server can't poll {simulation.address}."
                    wait_until(lambda: any(sentence in self.text_of(mail) for mail in mailbox.mails),
                               lambda: f"no mail says so: {[email.message_from_bytes(mail.content)['Subject'] for mail in mailbox.mails]}")
                    self.assertEqual({recipient for mail in mailbox.mails for recipient in mail.recipients}, {"operator@example.org"})


if __name__ == "__main__":
    main()
