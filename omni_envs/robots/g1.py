G1=None
