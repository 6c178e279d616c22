"""Every message between the sites, the key on which each is sent, and its bytes.

In: validated values. Out: MessagePack bytes, and back; arriving content is checked whole before anyone sees
it. `reasons` are codes, and `reason_words` makes sentences of them. Next: `farhand.common.link.link` carries the bytes.
"""
