"""The suite as a simulator that others steer: what the services of simulation_interfaces ask for, and the same without that package."""
