"""Policies out: files for deploy stacks, each proved against the network it came from."""
