"""The report of the audit: one HTML page with everything in it.

content  : what stands in it, as plain data
pictures : figures as the bytes of their files
gather   : the audit, the figures and the comparisons, computed at the same time
page     : the page
"""
