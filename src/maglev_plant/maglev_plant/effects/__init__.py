"""What a real stage has and the benchmark plant has not: one module an effect, each off by default.

A module holds the effect's record, the function that fills it from the parameters, and what is
compiled. ``maglev_plant.rough`` composes them.
"""
