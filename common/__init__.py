"""What both sites must agree on: the method's types, the modes, the wire, the link."""
