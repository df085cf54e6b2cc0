"""The paper's semi-Markov decision process: states, actions, transitions."""
