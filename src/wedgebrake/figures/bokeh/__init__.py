"""Pictures drawn with Bokeh for the page: thin renderers of ``wedgebrake.figures.data``.

motion                 the pictures of one motion
bifurcation, class_map, curve  pictures over parameters
trace                  a measured trace beside the motion
canvas                 axes, cursors and texts of pictures over parameters
glyphs                 images and boxes in them
chart                  empty figures, text over them, and updates that send only changes
"""
