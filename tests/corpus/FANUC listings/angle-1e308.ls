/PROG A
/POS
P[1]{
 GP1:
 UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',
 X = 1 mm, Y = 0 mm, Z = 0 mm,
 W = 1e308 deg, P = 10 deg, R = 0 deg
};
/END
