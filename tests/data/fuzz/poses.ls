/PROG  BALL
/MN
   1:J P[1] 100% FINE    ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   500.125  mm,	Y =   -20.500  mm,	Z =   300.000  mm,
	W =   180.000 deg,	P =    10.000 deg,	R =   -90.000 deg
};
P[2:"over the ball"]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =  1.0  mm,	Y =  2.0  mm,	Z =  3.0  mm,
	W =  0.0 deg,	P =  0.0 deg,	R =  90.0 deg
};
/END
