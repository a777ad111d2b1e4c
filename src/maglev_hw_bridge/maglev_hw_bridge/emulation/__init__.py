"""Boards that are none, and the machine behind them."""
