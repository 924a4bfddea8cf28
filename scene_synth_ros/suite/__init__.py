"""What the nodes have in common: life cycle, status, QoS, parameters, diagnostics."""
