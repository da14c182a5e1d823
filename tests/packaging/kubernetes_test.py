#!/usr/bin/python3
"""config/kubernetes: whether Kubernetes would take these documents, whether they fit each other, and our servers their configurations.
What the pods do is tested by tests/container_site.py, with containers.

Usage: kubernetes_test.py BIN_FOLDER [unittest arguments]
"""

import copy
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.kubernetes_documents import (  # noqa: E402
    FOLDER, check_document, configuration_files, documents, matching, named, of_kind, pods, yaml)

BIN = ""
SITES = ("base", "sandboxed", "site")
SECRETS = {"session-secret", "machines", "tls"}  # docs/clusters.md has the commands that make them


def configuration(template, found):
    """The only file of the pod's ConfigMap: its name and what it says."""
    (file, text), = configuration_files(template, found).items()
    return file, json.loads(text)


def mebibytes(quantity):
    number, unit = quantity[:-2], quantity[-2:]
    return int(number) * {"Mi": 1, "Gi": 1024}[unit]


class EachFolder(unittest.TestCase):
    def test_kubernetes_knows_every_key_and_misses_none(self):
        for name in (*SITES, "gpu", "autoscaling"):
            for document in documents(name):
                with self.subTest(folder=name):
                    check_document(document)

    def test_the_check_finds_what_is_wrong(self):
        good = named("Deployment", "session", documents("base"))

        def changed(change):
            document = copy.deepcopy(good)
            change(document["spec"])
            return document

        for change, why in ((lambda spec: spec.update(replica=2), "has no such key"),
                            (lambda spec: spec.update(replicas="2"), "expected int"),
                            (lambda spec: spec.pop("selector"), "`selector`, must not be `None`"),
                            (lambda spec: spec["template"]["spec"]["containers"][0].update(volumeMounts={}), "expected a list")):
            with self.assertRaisesRegex(AssertionError, why):
                check_document(changed(change))

    def test_pods_of_restricted_namespaces_ask_for_no_more_than_these_allow(self):
        for name in SITES:
            label = named("Namespace", "webots", documents(name))["metadata"]["labels"]["pod-security.kubernetes.io/enforce"]
            self.assertEqual(label, "privileged" if name == "sandboxed" else "restricted")
            for pod_name, template in pods(documents(name)).items():
                pod = template["spec"]
                self.assertTrue(pod["securityContext"]["runAsNonRoot"])
                self.assertFalse(pod["automountServiceAccountToken"])
                self.assertLessEqual({key for volume in pod["volumes"] for key in volume if key != "name"}, {"configMap", "secret", "emptyDir"})
                for container in pod["containers"]:
                    with self.subTest(folder=name, pod=pod_name):
                        context = container["securityContext"]
                        self.assertIs(context["allowPrivilegeEscalation"], False)
                        self.assertIs(context["readOnlyRootFilesystem"], True)
                        self.assertEqual(context["capabilities"], {"drop": ["ALL"]})
                        self.assertEqual(pod["securityContext"]["seccompProfile"], {"type": "RuntimeDefault"})
                        if label == "restricted":
                            self.assertNotIn("seccompProfile", context)
                            self.assertNotIn("procMount", context)

    def test_secrets_can_be_read_by_their_group_alone(self):
        for name in SITES:
            for template in pods(documents(name)).values():
                pod = template["spec"]
                found = {volume["secret"]["secretName"]: volume["secret"]["defaultMode"] for volume in pod["volumes"] if "secret" in volume}
                self.assertLessEqual(found.keys(), SECRETS)
                self.assertEqual(set(found.values()), {0o440})
                self.assertEqual(pod["securityContext"]["fsGroup"], pod["securityContext"]["runAsGroup"])


class Sites(unittest.TestCase):
    """Documents refer to each other by names."""

    def each(self):
        return [documents(name) for name in SITES]

    def test_what_selects_pods_finds_some_with_the_port_that_it_names(self):
        for found in self.each():
            for service in of_kind("Service", found):
                chosen = matching({"matchLabels": service["spec"]["selector"]}, found)
                self.assertEqual(chosen, {service["metadata"]["name"]})
                for port in service["spec"].get("ports", []):
                    self.assertIn(port["targetPort"], self.ports(found, chosen))
            for budget in of_kind("PodDisruptionBudget", found):
                self.assertEqual(matching(budget["spec"]["selector"], found), {budget["metadata"]["name"]})
            for policy in of_kind("NetworkPolicy", found):
                chosen = matching(policy["spec"]["podSelector"], found)
                self.assertTrue(chosen)
                for peer in [peer for rule in policy["spec"].get("ingress", []) + policy["spec"].get("egress", [])
                             for peer in rule.get("from", []) + rule.get("to", []) if "podSelector" in peer]:
                    self.assertTrue(matching(peer["podSelector"], found))
            for scaler in of_kind("HorizontalPodAutoscaler", found):
                target = scaler["spec"]["scaleTargetRef"]
                self.assertIn(target["name"], [each["metadata"]["name"] for each in of_kind(target["kind"], found)])

    @staticmethod
    def ports(found, chosen):
        return {port[key] for name in chosen for container in pods(found)[name]["spec"]["containers"] for port in container["ports"]
                for key in ("name", "containerPort")}

    def test_what_pods_mount_is_there(self):
        for found in self.each():
            for template in pods(found).values():
                volumes = {volume["name"] for volume in template["spec"]["volumes"]}
                for container in template["spec"]["containers"]:
                    self.assertEqual({mount["name"] for mount in container["volumeMounts"]}, volumes)
                configuration(template, found)

    def test_session_servers_find_all_machines_by_the_names_of_their_services(self):
        for found in self.each():
            _, session = configuration(pods(found)["session"], found)
            self.assertTrue(session["gateway"] and session["relay"], "machines are reached through it alone")
            self.assertTrue(session["sessionSecret"], "else each session server has paths of its own for the machines")
            expected = []
            for name, template in self.pools(found).items():
                service = named("Service", name, found)["spec"]
                self.assertEqual((service["clusterIP"], service["publishNotReadyAddresses"]), ("None", True))
                _, machine = configuration(template, found)
                self.assertEqual(machine["server"], f"{name}.webots.svc.cluster.local")
                self.assertIn({"name": "https", "containerPort": machine["port"]}, template["spec"]["containers"][0]["ports"])
                labels = {"labels": machine["labels"], "weight": 2} if "labels" in machine else {}
                expected.append({"address": f"dns:{machine['server']}:{machine['port']}", "internal": "https", **labels})
                for direction, pod in (("ingress", name), ("egress", "session")):
                    self.assertIn({"port": machine["port"]}, [{"port": port["port"]} for port in self.admitted(direction, pod, found)])
            self.assertCountEqual(session["simulationServers"], expected, "in the order of whichever kubectl")

    def test_the_certificate_of_simulation_servers_is_for_all_their_names(self):
        with open(os.path.join(FOLDER, "..", "..", "docs", "clusters.md")) as file:
            names, = re.findall("subjectAltName=([^']*)'", file.read())
        found = documents("site")
        machines = [configuration(template, found)[1]["server"] for template in self.pools(found).values()]
        self.assertCountEqual(names.split(","), [f"DNS:{name}" for name in machines])

    def test_pods_of_a_pool_are_all_alike(self):
        """So that there may be any number: none has a name, a port or a configuration of its own."""
        for found in self.each():
            for template in self.pools(found).values():
                container, = template["spec"]["containers"]
                self.assertNotIn("command", container)
                self.assertNotIn("args", container)
                self.assertFalse([each for each in container.get("env", []) if "valueFrom" in each])

    def test_pods_that_drain_hold_up_no_update(self):
        for found in self.each():
            for name, template in self.pools(found).items():
                pool = named("Deployment", name, found)["spec"]
                at_once = pool["strategy"]["rollingUpdate"]
                self.assertEqual(list(at_once.values()).count(0), 1, "a new pod comes first, or an old one goes first")
                self.assertGreater(pool["progressDeadlineSeconds"], template["spec"]["terminationGracePeriodSeconds"] + pool["minReadySeconds"])

    def test_probes_ask_the_server_as_it_answers(self):
        for found in self.each():
            for template in pods(found).values():
                _, config = configuration(template, found)
                container, = template["spec"]["containers"]
                for probe in ("livenessProbe", "readinessProbe"):
                    asked = container[probe]["httpGet"]
                    self.assertTrue(config["ssl"])
                    self.assertEqual((asked["port"], asked["scheme"]), ("https", "HTTPS"))
                    self.assertIn({"name": "https", "containerPort": config["port"]}, container["ports"])

    @staticmethod
    def pools(found):
        return {name: template for name, template in pods(found).items() if name != "session"}

    @staticmethod
    def admitted(direction, name, found):
        """The ports at which network policies let somebody reach these pods, or be reached from them."""
        policies = [policy["spec"] for policy in of_kind("NetworkPolicy", found) if name in matching(policy["spec"]["podSelector"], found)]
        return [port for policy in policies for rule in policy.get(direction, []) for port in rule["ports"]]

    def test_a_pod_has_the_time_to_let_its_simulations_end(self):
        for found in self.each():
            for template in self.pools(found).values():
                _, config = configuration(template, found)
                longest = config["timeout"] + config.get("extendable", 0) + config["startTimeout"]
                self.assertGreaterEqual(template["spec"]["terminationGracePeriodSeconds"], longest + 60)

    def test_a_pod_has_the_memory_that_its_simulations_may_use(self):
        for found in self.each():
            for template in self.pools(found).values():
                _, config = configuration(template, found)
                limit = template["spec"]["containers"][0]["resources"]["limits"]["memory"]
                self.assertLessEqual(config["maxConnections"] * config["simulationMemory"], mebibytes(limit))

    def test_our_servers_take_their_configurations(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1",
                            "-subj", "/CN=sim.example.org", "-addext", "subjectAltName=DNS:sim.example.org,DNS:*.webots.svc.cluster.local", "-keyout", f"{folder}/tls.key",
                            "-out", f"{folder}/tls.crt"], check=True, capture_output=True)
            with open(f"{folder}/word", "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
                file.write("0123456789abcdef")
            for found in self.each():
                for template in pods(found).values():
                    (name, text), = configuration_files(template, found).items()
                    for mounted in ("/etc/webots-cloud-tls", "/etc/webots-cloud-machines", "/etc/webots-cloud-secret"):
                        text = text.replace(mounted, folder)
                    self.take(folder, name, text.replace("/usr/share/webots_cloud/examples", folder))

    def take(self, folder, name, text):
        path = os.path.join(folder, name)
        with open(path, "w") as file:
            file.write(text)
        program = os.path.join(BIN, f"webots-{name.partition('.')[0]}-server")
        done = subprocess.run([program, "--check-config", path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        # The names are those of a cluster, and the certificate is our own.
        expected = re.compile(r"can't be resolved: |: self-signed certificate ")
        warnings = [line for line in done.stdout.splitlines() if "warning" in line and not expected.search(line)]
        self.assertEqual((done.returncode, warnings), (0, []), done.stdout)


class Autoscaling(unittest.TestCase):
    def test_a_pod_is_wanted_for_as_many_seats_as_it_has(self):
        found = documents("site")
        scaler, = of_kind("HorizontalPodAutoscaler", found)
        metric = scaler["spec"]["metrics"][0]["external"]
        _, config = configuration(pods(found)[scaler["spec"]["scaleTargetRef"]["name"]], found)
        self.assertEqual(metric["target"]["averageValue"], str(config["maxConnections"]))
        pool = named("Deployment", scaler["spec"]["scaleTargetRef"]["name"], found)
        self.assertNotIn("replicas", pool["spec"], "else each kubectl apply undoes what the autoscaler has done")
        with open(os.path.join(FOLDER, "autoscaling", "rules.yml")) as file:
            self.assertIn(f"record: {metric['metric']['name']}\n", file.read())

    def test_prometheus_takes_the_rules_and_they_say_how_many_seats_are_wanted(self):
        if not shutil.which("promtool"):
            self.skipTest("promtool is missing (package prometheus)")
        for arguments in (("check", "rules", "rules.yml"), ("test", "rules", "rules_test.yml")):
            self.promtool(*arguments)

    def test_prometheus_takes_the_jobs(self):
        """As far as Debian's can look, which is built without kubernetes_sd_configs."""
        with open(os.path.join(FOLDER, "autoscaling", "prometheus.yml")) as file:
            jobs = yaml.safe_load(file)["scrape_configs"]
        for job in jobs:
            self.assertEqual(job.pop("kubernetes_sd_configs"), [{"role": "pod", "namespaces": {"names": ["webots"]}}])
        with tempfile.NamedTemporaryFile("w", suffix=".yml") as file:
            yaml.safe_dump({"scrape_configs": jobs}, file)
            file.flush()
            self.promtool("check", "config", file.name)

    def promtool(self, *arguments):
        if not shutil.which("promtool"):
            self.skipTest("promtool is missing (package prometheus)")
        done = subprocess.run(["promtool", *arguments], cwd=os.path.join(FOLDER, "autoscaling"), stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop(1))
    if not shutil.which("kubectl"):
        sys.exit(print("skipped: kubectl is missing (package kubernetes-client)") or 77)
    unittest.main()
