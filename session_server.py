#!/usr/bin/env python3
"""Runs webots-session-server, as the Python server of this name was run: python session_server.py [CONFIGURATION]"""
from apps.python_command import run

run("session")
