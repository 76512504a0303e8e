//! MicMac and MMVII: a camera, two images and two points.

pub const CALIBRATION: &str = "<ExportAPERO><CalibrationInternConique><KnownConv>eConvApero_DistM2C</KnownConv><PP>1999.5 1499.5</PP><F>3000</F>
<SzIm>4000 3000</SzIm><PixelSzIm>0.004 0.004</PixelSzIm><CalibDistortion><ModPhgrStd><RadialePart><CDist>2009.5 \
1489.5</CDist><CoeffDist>-1e-8</CoeffDist>
<CoeffDist>2e-16</CoeffDist><PPaEqPPs>false</PPaEqPPs></RadialePart><P1>1e-7</P1><P2>-2e-7</P2><b1>1e-4</b1><b2>-3e-5</b2></ModPhgrStd></CalibDistortion>
</CalibrationInternConique></ExportAPERO>";

pub fn orientation(centre: &str) -> String {
    format!(
        "<ExportAPERO><OrientationConique><OrIntImaM2C><I00>0 0</I00><V10>1 0</V10><V01>0 \
         1</V01></OrIntImaM2C><TypeProj>eProjStenope</TypeProj>
<FileInterne>Ori-A/AutoCal.xml</FileInterne><Externe><Centre>{centre}</Centre><ParamRotation><CodageMatr><L1>0 -1 \
0</L1><L2>1 0 0</L2><L3>0 0 1</L3>
</CodageMatr></ParamRotation></Externe></OrientationConique></ExportAPERO>"
    )
}

pub const PMUL: &str = "BeginHeader-MicMacTiePointFormat\n   Version=0.0.0\nEndHeader\n#=*=\n1\n#Number of \
                        attribute\n3\na.jpg=0\nc.jpg=1\nb.jpg=2\n2\n2 3\n0 1 2\n\
    10 20 1 1 30.5 40 0.5\n11 21 1 1 31 41 0.5\n#====\n1 2\n2 1\n5 6 7 8 1\n";

pub fn binary_pmul() -> Vec<u8> {
    let mut bytes = b"BeginHeader-MicMacTiePointFormat\n   Version=0.0.0\nEndHeader\n".to_vec();
    bytes.extend([1u32, 3].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend(b"a.jpg=0\nc.jpg=1\nb.jpg=2\n");
    bytes.extend([2u32, 2, 3, 0, 1, 2].into_iter().flat_map(u32::to_le_bytes));
    let points = [10.0, 20.0, 1.0, 1.0, 30.5, 40.0, 0.5, 11.0, 21.0, 1.0, 1.0, 31.0, 41.0, 0.5];
    bytes.extend(points.into_iter().flat_map(f64::to_le_bytes));
    bytes.extend([1u32, 2, 2, 1].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend([5.0, 6.0, 7.0, 8.0, 1.0].into_iter().flat_map(f64::to_le_bytes));
    bytes
}

/// Ground control of the first version; the second point is a check point.
pub const GROUND: &str = "<DicoAppuisFlottant><OneAppuisDAF><Pt>1 2 30</Pt><NamePt>G1</NamePt><Incertitude>0.01 0.01 \
                          0.02</Incertitude></OneAppuisDAF>
<OneAppuisDAF><Pt>2 1 30</Pt><NamePt>K1</NamePt><Incertitude>-1 -1 \
-1</Incertitude></OneAppuisDAF></DicoAppuisFlottant>";
/// Marks of the first version.
pub const MARKS: &str =
    "<SetOfMesureAppuisFlottants><MesureAppuiFlottant1Im><NameIm>a.jpg</NameIm><PrecPointeByIm>0.5</PrecPointeByIm>
<OneMesureAF1I><NamePt>G1</NamePt><PtIm>100.5 \
200.25</PtIm></OneMesureAF1I></MesureAppuiFlottant1Im></SetOfMesureAppuisFlottants>";
/// A calibration of the second version.
pub const SECOND_CALIBRATION: &str = "<Root><Type>\"MMVII_Serialization\"</Type><Data><InternalCalibration><Projection>\"Stenope\"</Projection>
<PixelFrame><NbPix>4000 3000</NbPix></PixelFrame><PerfectProj><F>3000</F><PP>1999.5 1499.5</PP></PerfectProj>
<Distorsion><Radial><K1>-0.1</K1><K2>0.02</K2></Radial><Dec><p1>0.001</p1><p2>-0.002</p2></Dec><Aff><b1>1e-4</b1></Aff></Distorsion>
</InternalCalibration></Data></Root>";
/// Marks of the second version.
pub const SECOND_MARKS: &str = "<Root><Data><SetMesIm><NameIm>\"a.jpg\"</NameIm><Measures>
<el><Name>\"G1\"</Name><Pt>100.5 200.25</Pt><Sigma2>1 0 1</Sigma2></el></Measures></SetMesIm></Data></Root>";

/// An orientation of the second version.
pub fn second_orientation(image: &str, centre: &str) -> String {
    format!(
        "<Root><Data><CameraPose><NameImage>\"{image}\"</NameImage><NameInternalCalib>\"Calib-A\"</NameInternalCalib><Center>{centre}</Center>
<RotMatrix><AxeI>0 -1 0</AxeI><AxeJ>1 0 0</AxeJ><AxeK>0 0 1</AxeK></RotMatrix></CameraPose></Data></Root>"
    )
}

/// Pairs of the images a and b, and of b and a.
pub const PAIRS: &str = "10 20 30.5 40 1.0\n11 21 31 41\n";
pub const PAIRS_BACK: &str = "30.5 40 10 20 1.0\n31 41 11 21\n";

pub fn binary_pairs() -> Vec<u8> {
    let mut bytes = [2u32, 2].into_iter().flat_map(u32::to_le_bytes).collect::<Vec<u8>>();
    for pair in [[1.0, 10.0, 20.0, 30.5, 40.0], [1.0, 11.0, 21.0, 31.0, 41.0]] {
        bytes.extend(2u32.to_le_bytes());
        bytes.extend(pair.into_iter().flat_map(f64::to_le_bytes));
    }
    bytes
}

/// Ground control of the second version; the second point is not used there.
pub const SECOND_GROUND: &str = "<Root><Data><SetGCP><Measures><el><Name>\"G1\"</Name><Pt>1 2 \
                                 30</Pt><__Opt__Sigma2>1e-4 0 0 1e-4 0 4e-4</__Opt__Sigma2></el>
<el><Name>\"K1\"</Name><Pt>2 1 30</Pt></el></Measures></SetGCP></Data></Root>";
