"""Label-setting dynamic programmes over one satellite's tasks."""
