"""What is to be seen: arrays, their verdict, a caption and a table; no plotting library.

`figures` draws a view with matplotlib, `report` draws the same view with plotly. A view is made from one result (probes, a
cone, a curve) or from the finished results of a study.
"""
