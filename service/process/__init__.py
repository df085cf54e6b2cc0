"""What all processes of the service share: logs, traces, and a way to end."""
