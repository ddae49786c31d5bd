//! One small level in the dialects of portal files.

/// Three rooms in a row along x; squares of 2 x 2 between them, the second written by hand the other way.
pub const PRT1: &str = "PRT1\n3\n2\n\
    4 0 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\n\
    4 2 1 (8 -1 1 ) (8 1 1 ) (8 1 -1 ) (8 -1 -1 ) \n";
pub const PRT2: &str = "PRT2\n5\n3\n2\n\
    4 0 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\n\
    4 2 1 (8 -1 1) (8 1 1) (8 1 -1) (8 -1 -1)\n\
    3 0 -1\n1 -1\n2 4 -1\n";
pub const PRT1_AM: &str = "PRT1-AM\r\n3\r\n2\r\n5\r\n\
    4 0 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\r\n\
    4 2 1 (8 -1 1) (8 1 1) (8 1 -1) (8 -1 -1)\r\n\
    0\r\n1\r\n2\r\n0\r\n2\r\n";

/// As SDHLT writes [`PRT1`], with two, one and two leaves in its clusters.
pub const HALF_LIFE: &str = "\
3
2
2
1
2
4 0 1 (4.000000 -1.000000 -1.000000) (4.000000 1.000000 -1.000000) (4.000000 1.000000 1.000000) (4.000000 -1.000000 1.000000) 
4 2 1 (8.000000 -1.000000 1.000000) (8.000000 1.000000 1.000000) (8.000000 1.000000 -1.000000) (8.000000 -1.000000 -1.000000) 
";

/// What its vis leaves of it.
pub const HALF_LIFE_BARE: &str = "\
3
2
4 0 1 (4.000000 -1.000000 -1.000000) (4.000000 1.000000 -1.000000) (4.000000 1.000000 1.000000) (4.000000 -1.000000 1.000000) 
4 2 1 (8.000000 -1.000000 1.000000) (8.000000 1.000000 1.000000) (8.000000 1.000000 -1.000000) (8.000000 -1.000000 -1.000000) 
";

/// As q3map2 writes [`PRT1`], with a wall of the second cluster.
pub const QUAKE3: &str = "\
PRT1
3
2
1
4 0 1 0 (4 -1 -1 ) (4 1.000000 -1 ) (4 1 1 ) (4 -1 1 ) 
4 2 1 1 (8 -1 1 ) (8 1 1 ) (8 1 -1 ) (8 -1 -1 ) 
3 1 (4 2 0 ) (4 3 0 ) (4 2 1 ) 
";
