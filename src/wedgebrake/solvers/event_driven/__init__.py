"""Exact solution for set-valued friction: closed forms joined at located events."""
