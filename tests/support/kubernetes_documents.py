"""The documents that kustomize makes of a folder of config/kubernetes, and what the models of Kubernetes' own client say of them."""

import functools
import os
import re
import shutil
import subprocess
import unittest

try:
    import kubernetes.client
    import yaml
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-kubernetes)") or 77)

FOLDER = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", "config", "kubernetes"))

# What is newer than Debian 12's python3-kubernetes, which knows Kubernetes 1.22.
NEWER = {"V1PodSpec": {"hostUsers": "bool"}}
NEWER_KINDS = {"V2HorizontalPodAutoscaler": "V2beta2HorizontalPodAutoscaler"}


@functools.cache
def documents(name):
    """What `kubectl kustomize` makes of config/kubernetes/<name>: a list of dictionaries."""
    if not shutil.which("kubectl"):
        raise unittest.SkipTest("kubectl is missing (package kubernetes-client)")
    done = subprocess.run(["kubectl", "kustomize", os.path.join(FOLDER, name)], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"kubectl kustomize {name}: {done.stderr}")
    return list(yaml.safe_load_all(done.stdout))


def of_kind(kind, found):
    return [each for each in found if each["kind"] == kind]


def named(kind, name, found):
    return next(each for each in of_kind(kind, found) if each["metadata"]["name"] == name)


def model_of(document):
    version = document["apiVersion"].rpartition("/")[2]
    name = version[0].upper() + version[1:] + document["kind"]
    return NEWER_KINDS.get(name, name) if not hasattr(kubernetes.client, name) else name


def check(value, kind, place):
    """Fails where a value is not what the API takes there: unknown keys, missing ones, other types."""
    if value is None:
        raise AssertionError(f"{place}: there is nothing")
    if inner := re.fullmatch(r"list\[(.*)\]", kind):
        if not isinstance(value, list):
            raise AssertionError(f"{place}: expected a list, found {value!r}")
        for number, each in enumerate(value):
            check(each, inner[1], f"{place}[{number}]")
    elif inner := re.fullmatch(r"dict\(str, (.*)\)", kind):
        if not isinstance(value, dict):
            raise AssertionError(f"{place}: expected keys and values, found {value!r}")
        for key, each in value.items():
            check(each, inner[1], f"{place}.{key}")
    elif kind in ("str", "int", "bool", "float", "datetime"):
        if type(value).__name__ != kind:
            raise AssertionError(f"{place}: expected {kind}, found {value!r}")
    elif kind == "object":  # a number with a unit, or a name in place of a number
        if not isinstance(value, (str, int)) or isinstance(value, bool):
            raise AssertionError(f"{place}: expected a number or a word, found {value!r}")
    else:
        check_object(value, getattr(kubernetes.client, kind), place)


def check_object(value, model, place):
    """AssertionError where a document is none of this model; `place` is where it stands in the whole."""
    if not isinstance(value, dict):
        raise AssertionError(f"{place}: expected {model.__name__}, found {value!r}")
    attributes = {key: attribute for attribute, key in model.attribute_map.items()}
    newer = NEWER.get(model.__name__, {})
    for key, each in value.items():
        if key not in attributes and key not in newer:
            raise AssertionError(f"{place}.{key}: {model.__name__} has no such key")
        check(each, newer[key] if key in newer else model.openapi_types[attributes[key]], f"{place}.{key}")
    try:
        model(**{attributes[key]: each for key, each in value.items() if key in attributes})  # which asks for what must be there
    except ValueError as error:
        raise AssertionError(f"{place}: {error}") from error


def check_document(document):
    check(document, model_of(document), f"{document['kind']} {document['metadata']['name']}")


def pods(found):
    """What each Deployment makes: name and template."""
    return {each["metadata"]["name"]: each["spec"]["template"] for each in of_kind("Deployment", found)}


def matching(selector, found):
    """The names of Deployments whose pods a selector chooses."""
    wanted = selector.get("matchLabels", {})
    return {name for name, pod in pods(found).items() if wanted.items() <= pod["metadata"]["labels"].items()}


def configuration_files(template, found):
    """What the ConfigMaps of a pod say: file name and text."""
    names = [volume["configMap"]["name"] for volume in template["spec"]["volumes"] if "configMap" in volume]
    return {file: text for name in names for file, text in named("ConfigMap", name, found)["data"].items()}
