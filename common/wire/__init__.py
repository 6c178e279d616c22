"""Every message between the sites, the key that each travels on, and its bytes.

In: validated values. Out: MessagePack bytes, and back; content that arrives is checked whole before anyone sees it.
Next: `farhand.common.link.link` carries the bytes.
"""
