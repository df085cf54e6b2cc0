"""The paper's study, run again (``make paper``); the order of work is in ``study``."""
