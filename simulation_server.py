#!/usr/bin/env python3
"""Runs webots-simulation-server, as the Python server of this name was run: python simulation_server.py [CONFIGURATION]"""
from apps.python_command import run

run("simulation")
