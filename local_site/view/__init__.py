"""The operator's web page: what the console knows, drawn; what the operator does, as intents to the console."""
