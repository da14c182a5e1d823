#!/usr/bin/python3
"""Prints what is in a container image of a Debian, as SPDX 2.3 in JSON: every package that dpkg knows, with its version and its source.

Usage: sbom.py IMAGE
"""

import json
import subprocess
import sys
from urllib.parse import quote

FIELDS = ("binary:Package", "Version", "Architecture", "source:Package", "source:Version", "Maintainer", "Homepage")


def run(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command[:3])}: exit status {done.returncode}")
    return done.stdout


def inspect(image):
    return json.loads(run("docker", "image", "inspect", image))[0]


def installed(image):
    """The packages of an image, as dictionaries of FIELDS."""
    wanted = "\\t".join(f"${{{field}}}" for field in ("db:Status-Status", *FIELDS)) + "\\n"
    said = run("docker", "run", "--rm", "--network", "none", "--entrypoint", "dpkg-query", image, "--show", "--showformat", wanted)
    rows = [line.split("\t") for line in said.splitlines()]
    return [dict(zip(FIELDS, row[1:])) for row in rows if row[0] == "installed"]


def spdx_id(text):
    return "SPDXRef-" + "".join(letter if letter.isalnum() or letter in ".-" else "-" for letter in text)


def package(entry):
    name = entry["binary:Package"].partition(":")[0]
    vendor = "webots_cloud" if name.startswith("webots-cloud") else "debian"
    source = {"upstream": f"{entry['source:Package']}@{entry['source:Version']}"} if entry["source:Package"] else {}
    qualifiers = "&".join(f"{key}={quote(value, safe='')}" for key, value in {"arch": entry["Architecture"], **source}.items())
    return {
        "SPDXID": spdx_id(f"Package-{name}-{entry['Architecture']}"),
        "name": name,
        "versionInfo": entry["Version"],
        "supplier": f"Organization: {entry['Maintainer']}",
        "downloadLocation": "NOASSERTION",
        "homepage": entry["Homepage"] or "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": "NOASSERTION",  # /usr/share/doc/<name>/copyright in the image
        "copyrightText": "NOASSERTION",
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": f"pkg:deb/{vendor}/{quote(name)}@{quote(entry['Version'], safe='')}?{qualifiers}"}],
    }


def document(name, image, packages):
    """`image` is what docker inspects of it."""
    root = {
        "SPDXID": "SPDXRef-Image",
        "name": name,
        "versionInfo": image["Id"],
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "primaryPackagePurpose": "CONTAINER",
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": (image["Config"]["Labels"] or {}).get("org.opencontainers.image.licenses", "NOASSERTION"),
        "copyrightText": "NOASSERTION",
    }
    return {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": name,
        "documentNamespace": f"https://webots-cloud.invalid/spdx/{image['Id'].replace(':', '-')}",
        "creationInfo": {"created": image["Created"].partition(".")[0].rstrip("Z") + "Z", "creators": ["Tool: webots_cloud-sbom"]},
        "packages": [root, *packages],
        "relationships": [
            {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-Image"},
            *({"spdxElementId": "SPDXRef-Image", "relationshipType": "CONTAINS", "relatedSpdxElement": each["SPDXID"]} for each in packages),
        ],
    }


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    name = sys.argv[1]
    print(json.dumps(document(name, inspect(name), [package(each) for each in installed(name)]), indent=2))


if __name__ == "__main__":
    main()
