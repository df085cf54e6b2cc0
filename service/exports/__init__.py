"""The forms that a timeline is offered in: one module for each, from documents to text."""
