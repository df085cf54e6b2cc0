"""What every process of the service has: logs, traces, and a way to end."""
