"""All control laws over the same experiments on the same stage: a table and their regions of
operation.
"""
