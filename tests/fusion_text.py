"""NC text of a slot as the posts of Fusion write it: tool and material in comments."""

FUSION = """%
(T3 D=8. CR=0. - ZMIN=-2. - flat end mill)
(MATERIAL STEEL 1045)
G21 G90 G94 G17
T3 M6
S4000 M3
G0 X-10 Y5 Z15
Z5
G1 Z-2 F100
X30 F400
Y15
G0 Z15
X0
M5
M2
%
"""
