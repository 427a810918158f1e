"""Figures of results.

data        contents of pictures, computed once
matplotlib  pictures for files and notebooks
bokeh       pictures for the page
style       colours, symbols and number formats common to all
"""
