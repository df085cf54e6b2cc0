"""The Slewline service: HTTP API, jobs and command line over the planning core."""
