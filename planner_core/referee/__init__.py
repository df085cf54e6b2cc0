"""The referee: replays a plan, reports what it earns and which rules it breaks."""
