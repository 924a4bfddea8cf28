"""From a parse tree to a layout: energies, proposals, the Metropolis-Hastings chain and its schedule."""
