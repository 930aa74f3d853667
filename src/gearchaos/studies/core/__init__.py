"""What every study is made of: axes, options, declaration, cost and price, initial values, the list of all."""
