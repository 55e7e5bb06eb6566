"""From trial tables to numbers and figures."""
