#!/usr/bin/env python3
"""Writes the notices of everything a Feedwright binary is built from.

    python3 tests/bench/notices.py > THIRD-PARTY-NOTICES.txt
    python3 tests/bench/notices.py --check    names crates without a licence text, or under one that deny.toml does not allow

In: `cargo metadata` (crates that are linked or run while building, for any system), the licence files of their sources. Out: each crate
with its version, its licence and its place; then each text once, with the crates it belongs to. For a choice (`MIT OR Apache-2.0`) all texts
that the crate brings are kept: more notice than is asked for, never less.
"""

import json
import os
import re
import subprocess
import sys
import tomllib

ROOT = os.path.join(os.path.dirname(__file__), "..", "..")
TEXTS = re.compile(r"^(licen[cs]e|copying|notice|unlicense)", re.IGNORECASE)


def metadata():
    command = ["cargo", "metadata", "--format-version", "1", "--locked"]
    return json.loads(subprocess.check_output(command, cwd=ROOT))


def shipped(data):
    """Crates reached from ours (the program and the Python wheel) without development dependencies."""
    nodes = {node["id"]: node for node in data["resolve"]["nodes"]}
    found, rest = set(), list(data["workspace_members"])
    while rest:
        here = rest.pop()
        if here in found:
            continue
        found.add(here)
        for other in nodes[here]["deps"]:
            if any(kind["kind"] != "dev" for kind in other["dep_kinds"]):
                rest.append(other["pkg"])
    found.difference_update(data["workspace_members"])
    crates = [package for package in data["packages"] if package["id"] in found]
    return sorted(crates, key=lambda crate: (crate["name"], crate["version"]))


def texts(crate):
    folder = os.path.dirname(crate["manifest_path"])
    names = sorted(name for name in os.listdir(folder) if TEXTS.match(name) and os.path.isfile(os.path.join(folder, name)))
    read = lambda name: open(os.path.join(folder, name), encoding="utf-8", errors="replace").read().replace("\r\n", "\n").strip()
    return [read(name) for name in names]


def is_allowed(expression, allowed):
    """OR: one of them; AND: each."""
    expression = expression.replace("/", " OR ")
    if expression.startswith("(") or " AND " in expression:
        return all(is_allowed(part.strip().strip("()"), allowed) for part in expression.split(" AND "))
    return any(part.strip() in allowed for part in expression.split(" OR "))


def check(crates):
    with open(os.path.join(ROOT, "deny.toml"), "rb") as file:
        allowed = tomllib.load(file)["licenses"]["allow"]
    refused = [crate for crate in crates if not is_allowed(crate["license"] or "", allowed)]
    silent = [crate["name"] for crate in crates if not texts(crate)]
    for crate in refused:
        print(f"{crate['name']} {crate['version']}: {crate['license']} is not allowed by deny.toml")
    print(f"{len(crates)} crates, {len(refused)} under a licence that is not allowed, {len(silent)} without a text of their own: {', '.join(silent)}")
    return 1 if refused else 0


def write(crates):
    print("Feedwright is built from the crates below, each under its own licence. Made by: python3 tests/bench/notices.py")
    print()
    by_text = {}
    for crate in crates:
        name = f"{crate['name']} {crate['version']}"
        print(f"{name}: {crate['license']}, {crate['repository'] or 'https://crates.io/crates/' + crate['name']}")
        for text in texts(crate):
            by_text.setdefault(" ".join(text.split()), (text, []))[1].append(name)
    for text, names in sorted(by_text.values(), key=lambda entry: entry[1]):
        print("\n" + "=" * 78)
        print("\n".join(names))
        print("-" * 78)
        print(text)


if __name__ == "__main__":
    crates = shipped(metadata())
    if "--check" in sys.argv:
        sys.exit(check(crates))
    write(crates)
