"""The report of the audit: one HTML page with everything in it.

content  : its contents, as plain data
gather   : the audit, the figures and the comparisons, computed at the same time
page     : the page
"""
