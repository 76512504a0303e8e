//! What holds for every figure: well formed, the same bytes twice, no panic on odd data, and honest about it.

use super::super::style::CHOSEN;
use super::super::svg::tests::assert_well_formed;
use super::*;

const NAN: f64 = f64::NAN;

/// Every figure, drawn from the same few numbers.
fn all(values: &[f64], title: &str) -> Vec<(&'static str, String)> {
    let title: String = title.into();
    let n = values.len() as f64;
    let place = |i: usize| [100.0 * i as f64, 40.0 * (i % 3) as f64];
    let arrows: Vec<Arrow> = values.iter().enumerate().map(|(i, v)| (place(i), [*v, 0.5 * v])).collect();
    let points: Vec<[f64; 2]> = values.iter().enumerate().map(|(i, v)| [i as f64, *v]).collect();
    let y = || Axis::new(title.clone(), "mm");
    let panel = |log: bool| Panel {
        title: title.clone(),
        x: Axis::new("time", "s"),
        y: if log { y().log() } else { y() },
        series: vec![Series::new(title.clone(), points.clone()).sigma(values.to_vec())],
    };
    let signed = |style| PlanSigned {
        title: title.clone(),
        values: values.iter().enumerate().map(|(i, v)| (place(i), *v)).collect(),
        unit: "mm".into(),
        style,
        ..PlanSigned::default()
    };
    let flagged = ArrowSet {
        label: title.clone(),
        arrows: arrows.clone(),
        significant: vec![true, false],
        ..ArrowSet::default()
    };
    let field = VectorField {
        sets: vec![flagged, ArrowSet { label: "other".into(), arrows: arrows.clone(), ..ArrowSet::default() }],
        marks: vec![(title.clone(), [10.0, 20.0])],
        ..VectorField::single(&title, [500.0, 400.0], Vec::new(), "px")
    };
    let stations: Vec<Station> = values
        .iter()
        .enumerate()
        .map(|(i, v)| Station { position_m: [place(i)[1], place(i)[0], *v], flight: i, ..Station::default() })
        .collect();
    let flights = FlightPlan {
        title: title.clone(),
        flights: vec![title.clone()],
        images: stations,
        control_m: values.iter().map(|v| [*v, 0.0, 1.0]).collect(),
        control_names: vec![title.clone()],
        ..FlightPlan::default()
    };
    let map = |colours, limit| HeatMap {
        title: title.clone(),
        columns: 2,
        values: values.to_vec(),
        marked: vec![true],
        value: y(),
        colours,
        limit,
        ..HeatMap::default()
    };
    let bar = |(i, v): (usize, &f64)| ImageBar {
        value: *v,
        whisker: Some(v.abs()),
        flight: i,
        significant: i % 2 == 0,
        ..ImageBar::default()
    };
    let bars = ImageBars {
        title: title.clone(),
        bars: values.iter().enumerate().map(bar).collect(),
        y: y(),
        flights: vec![title.clone()],
        ..ImageBars::default()
    };
    let step = |v: &f64| LedgerStep { name: title.clone(), heldout_px: *v, check_mm: Some(*v), sigma0: *v };
    let sample = |label: &str| Sample { label: label.into(), values: values.to_vec(), ..Sample::default() };
    let binned = BinnedProfile {
        title: title.clone(),
        x: Axis::new("row", "px"),
        y: y(),
        cloud: points.clone(),
        bins: vec![(title.clone(), values.iter().map(|v| [n, *v, 0.1]).collect())],
        bars: "± sigma".into(),
        dimmed: 0,
        width: None,
    };
    let chart = |log| LineChart {
        title: title.clone(),
        panels: vec![panel(log); 3],
        columns: 2,
        note: title.clone(),
        width: None,
    };
    let hist = |samples| Histogram { title: title.clone(), x: y(), samples, ..Histogram::default() };
    let names: Vec<String> = values.iter().map(|_| title.clone()).collect();
    let matrix = CorrelationMatrix {
        title: title.clone(),
        values: values.iter().flat_map(|v| values.iter().map(move |w| v * w)).collect(),
        names,
        threshold: 0.9,
    };
    vec![
        ("vector_field", vector_field(&field)),
        (
            "plan_arrows",
            residuals_plan_arrows(&PlanArrows {
                title: title.clone(),
                arrows,
                unit: "mm".into(),
                ..PlanArrows::default()
            }),
        ),
        ("plan_strokes", residuals_plan_signed(&signed(SignedStyle::Strokes))),
        ("plan_dots", residuals_plan_signed(&signed(SignedStyle::Dots))),
        ("flights", flights_plan_profile(&flights)),
        ("lines", line_chart(&chart(false))),
        ("log_lines", line_chart(&chart(true))),
        ("profile", profile(&binned)),
        (
            "ledger",
            ledger(&Ledger { title: title.clone(), steps: values.iter().map(step).collect(), ..Ledger::default() }),
        ),
        ("histogram", histogram(&hist(vec![sample(&title)]))),
        ("histograms", histogram(&hist(vec![sample("a"), sample("b")]))),
        ("image_bars", image_bars(&bars)),
        ("signed_map", heat_map(&map(Colours::Signed, Some(0.5)))),
        ("magnitude_map", heat_map(&map(Colours::Magnitude, None))),
        ("correlation", correlation_matrix(&matrix)),
    ]
}

#[test]
fn figures_are_well_formed_and_the_same_twice() {
    let values = [0.2, -0.4, 0.9, 1.5, -0.01, 0.0, 0.7];
    let hostile = "a < b & \"c\" </text><script>'";
    let (first, second) = (all(&values, hostile), all(&values, hostile));
    for ((name, a), (_, b)) in first.iter().zip(&second) {
        assert_eq!(a, b, "{name}: same data, same bytes");
        assert_well_formed(a);
        assert!(a.contains("viewBox") && a.contains("a &lt; b &amp;") && !a.contains("<script"), "{name}");
        assert!(!a.contains("no data"), "{name} has data");
    }
}

#[test]
fn empty_figures_say_so() {
    for (name, svg) in all(&[], "t") {
        assert_well_formed(&svg);
        assert!(svg.contains("no data"), "{name}: an empty figure is not a picture of nothing");
    }
}

#[test]
fn odd_data_do_not_panic() {
    let cases: [&[f64]; 9] = [
        &[0.0],
        &[5510.09],
        &[0.0, 0.0],
        &[1e-300, 2e-300],
        &[1e300, -1e300, 1.0],
        &[f64::MIN_POSITIVE, f64::MAX],
        &[1.0, 1.0 + f64::EPSILON],
        &[-1.0, -1.0],
        &[1e140, -1e-140, 0.3],
    ];
    for values in cases {
        for (name, svg) in all(values, "t") {
            assert!(svg.len() < 2_000_000, "{name} of {values:?}");
            assert_well_formed(&svg);
        }
    }
}

#[test]
fn what_is_not_finite_is_left_out_with_a_visible_remark() {
    for (name, svg) in all(&[0.3, NAN, 0.5, f64::INFINITY], "t") {
        assert_well_formed(&svg);
        let said = svg.contains("Not drawn:") || svg.contains("cells without value:");
        assert!(said, "{name} says what it leaves out");
    }
    for (name, svg) in all(&[NAN], "t") {
        assert!(svg.contains("no data"), "{name}");
    }
}

#[test]
fn wild_counts_do_not_panic() {
    let bar = ImageBar { value: 1.0, flight: usize::MAX, ..ImageBar::default() };
    assert_well_formed(&image_bars(&ImageBars { bars: vec![bar], ..ImageBars::default() }));
    let images = vec![Station { flight: usize::MAX, ..Station::default() }];
    assert_well_formed(&flights_plan_profile(&FlightPlan { images, ..FlightPlan::default() }));
    assert_well_formed(&heat_map(&HeatMap { columns: usize::MAX, values: vec![1.0], ..HeatMap::default() }));
    let samples = vec![Sample { label: "s".into(), values: vec![1.0, 2.0], ..Sample::default() }];
    assert_well_formed(&histogram(&Histogram { bins: usize::MAX, samples, ..Histogram::default() }));
    let panels = vec![Panel::default()];
    assert_well_formed(&line_chart(&LineChart { columns: usize::MAX, panels, ..LineChart::default() }));
}

#[test]
fn a_log_axis_counts_what_it_cannot_show() {
    let series = vec![Series::new("s", vec![[1.0, 0.0], [2.0, 3.0], [3.0, -1.0]])];
    let panel = Panel { y: Axis::new("v", "").log(), series, ..Panel::default() };
    let svg = line_chart(&LineChart { panels: vec![panel], ..LineChart::default() });
    assert!(svg.contains("Not drawn: 2 values are not positive"), "{svg}");
}

#[test]
fn an_arrow_points_where_its_displacement_points() {
    // Over the sensor y points down: a displacement of (+1, +1) px goes right and down the page.
    let field = VectorField {
        scale: Some(10.0),
        ..VectorField::single("t", [100.0, 100.0], vec![([50.0, 50.0], [1.0, 1.0])], "px")
    };
    let svg = vector_field(&field);
    let shaft = svg.split("<path d=\"M").find(|p| p.contains("#0072B2")).expect("the arrow");
    let numbers: Vec<f64> = shaft.split(['L', ' ', 'M']).take(4).map(|v| v.parse().expect("a coordinate")).collect();
    assert!(
        (numbers[2] - numbers[0] - 10.0).abs() < 0.02 && (numbers[3] - numbers[1] - 10.0).abs() < 0.02,
        "{numbers:?}"
    );
}

#[test]
fn a_crowd_of_points_is_thinned_and_the_figure_says_so() {
    let values = (0..5000).map(|i| ([(i % 100) as f64, (i / 100) as f64], 1.0)).collect();
    let svg = residuals_plan_signed(&PlanSigned { values, unit: "mm".into(), ..PlanSigned::default() });
    let (drawn, rest) = svg.split_once(" of 5000 points are drawn").expect("the remark");
    assert!(!rest.is_empty());
    let drawn: usize = drawn.rsplit('>').next().and_then(|n| n.parse().ok()).expect("a count");
    assert!((300..=1000).contains(&drawn), "{drawn}");
    // One shaft and two barbs per arrow.
    let arrows = svg.split("<path d=\"").find(|p| p.contains("stroke=\"#D55E00\"") && p.len() > 2000).expect("arrows");
    assert_eq!(arrows.matches('M').count(), 2 * drawn);
}

/// Arrows of these points, all of them by `d` mm, in a picture of these coordinates.
fn mapped(points: &[[f64; 2]], d: [f64; 2], frame: MapFrame) -> String {
    residuals_plan_arrows(&PlanArrows {
        arrows: points.iter().map(|p| (*p, d)).collect(),
        names: points.iter().map(|[x, y]| format!("p<{x} {y}>")).collect(),
        scale: Some(10.0),
        unit: "mm".into(),
        title: "t".into(),
        frame,
        ..PlanArrows::default()
    })
}

#[test]
fn east_is_to_the_right_and_north_is_up() {
    let shaft = |points: [[f64; 2]; 2], d: [f64; 2]| {
        let svg = mapped(&points, d, MapFrame::Local);
        let path = svg.split("stroke=\"#0072B2\"").nth(1).and_then(|rest| rest.split("<path d=\"M").nth(1));
        let numbers = path.expect("the arrows").split(['L', ' ', 'M']).take(4);
        let v: Vec<f64> = numbers.map(|v| v.parse().expect("a coordinate")).collect();
        [v[2] - v[0], v[3] - v[1]]
    };
    let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 0.02 && (a[1] - b[1]).abs() < 0.02;
    for points in [[[0.0, 0.0], [90.0, 10.0]], [[0.0, 0.0], [10.0, 90.0]]] {
        assert!(close(shaft(points, [1.0, 0.0]), [10.0, 0.0]) && close(shaft(points, [0.0, 1.0]), [0.0, -10.0]));
    }
}

#[test]
fn a_map_has_one_scale_names_and_a_north_arrow() {
    let corridor = [[0.0, 0.0], [5.0, 900.0]];
    let svg = mapped(&corridor, [1.0, 0.0], MapFrame::EastNorth);
    assert_well_formed(&svg);
    let per_m = |axis: char| {
        let ends = |attribute: String| -> f64 {
            let ends: Vec<f64> = of_area(&svg, &attribute).split(' ').map(|v| v.parse().expect("a number")).collect();
            (ends[1] - ends[0]).abs()
        };
        ends(format!("data-p{axis}")) / ends(format!("data-{axis}"))
    };
    assert!((per_m('x') / per_m('y') - 1.0).abs() < 1e-3, "{} and {}", per_m('x'), per_m('y'));
    assert_eq!((of_area(&svg, "data-xname"), of_area(&svg, "data-yname")), ("E", "N"));
    assert!(svg.contains(">N</text>") && !mapped(&corridor, [1.0, 0.0], MapFrame::Local).contains(">N</text>"));
    assert_eq!(svg.matches("<title>p&lt;").count(), corridor.len(), "every arrow has its name");
}

/// The value of an attribute of the first plotting area.
fn of_area<'a>(svg: &'a str, attribute: &str) -> &'a str {
    let area = svg.split("<rect class=\"plot\"").nth(1).and_then(|rest| rest.split("/>").next()).expect("an area");
    let value = area.split(&format!(" {attribute}=\"")).nth(1).expect("the attribute");
    value.split('"').next().expect("its end")
}

#[test]
fn plotting_areas_say_which_values_lie_at_their_edges() {
    let field = VectorField {
        scale: Some(10.0),
        ..VectorField::single("t", [100.0, 50.0], vec![([50.0, 25.0], [1.0, 1.0])], "px")
    };
    let svg = vector_field(&field);
    assert!(svg.contains(" data-scale=\"10\""));
    let numbers = |attribute: &str| -> Vec<f64> {
        of_area(&svg, attribute).split(' ').map(|v| v.parse().expect("a number")).collect()
    };
    // The arrow begins in the middle of the sensor, and so does its pixel.
    let ([x, px], [y, py]) = ([numbers("data-x"), numbers("data-px")], [numbers("data-y"), numbers("data-py")]);
    let at = |value: f64, domain: &[f64], pixels: &[f64]| {
        pixels[0] + (value - domain[0]) / (domain[1] - domain[0]) * (pixels[1] - pixels[0])
    };
    let shaft = svg.split("<path d=\"M").find(|p| p.contains("#0072B2")).expect("the arrow");
    let from: Vec<f64> = shaft.split(['L', ' ', 'M']).take(2).map(|v| v.parse().expect("a coordinate")).collect();
    assert!((at(50.0, &x, &px) - from[0]).abs() < 0.02 && (at(25.0, &y, &py) - from[1]).abs() < 0.02, "{svg}");
    assert_eq!((of_area(&svg, "data-xname"), of_area(&svg, "data-xlog")), ("x", "0"));
    let series = vec![Series::new("s", vec![[1.0, 0.1], [2.0, 100.0]])];
    let panel = Panel { y: Axis::new("v", "").log(), series, ..Panel::default() };
    let log = line_chart(&LineChart { panels: vec![panel], ..LineChart::default() });
    assert_eq!(of_area(&log, "data-ylog"), "1");
}

#[test]
fn what_stands_out_stands_before_what_is_dimmed() {
    let arrows = vec![([50.0, 50.0], [1.0, 0.0])];
    let set =
        |label: &str, dimmed| ArrowSet { label: label.into(), arrows: arrows.clone(), dimmed, ..ArrowSet::default() };
    let mut field = VectorField::single("t", [100.0, 100.0], Vec::new(), "px");
    field.sets = vec![set("all", true), set("brushed", false)];
    let svg = vector_field(&field);
    let places: Vec<usize> = ["#B5B5B5", CHOSEN].iter().map(|colour| svg.rfind(colour).expect("a colour")).collect();
    assert!(places[0] < places[1] && !svg.contains("#0072B2"), "{svg}");
}

#[test]
fn what_is_brushed_has_one_colour_in_every_figure() {
    let series = |label: &str, dimmed| Series::new(label, vec![[1.0, 2.0], [2.0, 3.0]]).dimmed(dimmed);
    let all = vec![
        series("x", true),
        series("y", true),
        series("x of the brushed", false),
        series("y of the brushed", false),
    ];
    let lines =
        line_chart(&LineChart { panels: vec![Panel { series: all, ..Panel::default() }], ..LineChart::default() });
    let sample = |label: &str, dimmed| Sample { label: label.into(), values: vec![1.0, 2.0], dimmed };
    let samples = vec![
        sample("x", true),
        sample("y", true),
        sample("x of the brushed", false),
        sample("y of the brushed", false),
    ];
    let bins = histogram(&Histogram { samples, ..Histogram::default() });
    for svg in [lines, bins] {
        assert!(svg.contains(CHOSEN) && svg.contains("#B5B5B5"), "{svg}");
        for other in ["#0072B2", "#D55E00", "#009E73", "#E69F00"] {
            assert!(!svg.contains(other), "{other}: {svg}");
        }
        // Of two the second is dashed.
        assert!(svg.lines().any(|line| line.contains(CHOSEN) && line.contains("stroke-dasharray")), "{svg}");
    }
}

#[test]
fn a_cell_is_shaded_by_its_measurements_and_says_their_number() {
    let cell = |x: f64, n: usize| Cell { centre: [x, 50.0], size: [60.0, 100.0], n, words: format!("{n} & more") };
    let mut field = VectorField::single("t", [100.0, 100.0], vec![([30.0, 50.0], [1.0, 0.0])], "px");
    field.cells = vec![cell(30.0, 3), cell(90.0, 40), cell(60.0, 0)];
    let svg = vector_field(&field);
    assert_well_formed(&svg);
    let cells: Vec<&str> = svg.lines().filter(|line| line.contains("&amp; more")).collect();
    let of = |cell: &str, attribute: &str| -> f64 {
        let rest = cell.split(&format!(" {attribute}=\"")).nth(1).and_then(|rest| rest.split('"').next());
        rest.and_then(|text| text.parse().ok()).expect("a number")
    };
    assert!(cells[0].contains("<title>3 &amp; more</title>"), "{svg}");
    let shades: Vec<f64> = cells.iter().map(|cell| of(cell, "fill-opacity")).collect();
    assert!(shades[0] > 0.0 && shades[0] < shades[1] && shades[2] == 0.0, "{shades:?}");
    // The second cell reaches beyond the sensor, by half of its width less a sixth.
    assert!((of(cells[1], "width") / of(cells[0], "width") - 40.0 / 60.0).abs() < 1e-3, "{svg}");
    assert!(svg.contains("3 to 40 measurements in a cell"), "{svg}");
}

#[test]
fn a_width_is_kept_and_text_keeps_its_size() {
    let samples = vec![Sample { label: "s".into(), values: vec![1.0, 2.0], ..Sample::default() }];
    let wide = Histogram { samples, ..Histogram::default() };
    let narrow = histogram(&Histogram { width: Some(400.0), ..wide.clone() });
    assert!(narrow.contains("width=\"400\"") && histogram(&wide).contains("width=\"760\""));
    assert!(narrow.contains("font-size=\"12\"") || narrow.contains("font-size=\"12.5\""));
    assert!(histogram(&Histogram { width: Some(f64::NAN), ..wide }).contains("width=\"760\""));
    let step = |v: f64| LedgerStep { name: "s".into(), heldout_px: v, check_mm: Some(v), sigma0: v };
    let steps = vec![step(2.0), step(1.0)];
    let small = ledger(&Ledger { title: "t".into(), steps: steps.clone(), width: Some(250.0), ..Ledger::default() });
    assert!(small.contains("Check points, 3D RMS (mm)") && !small.contains("sigma0"), "one panel: {small}");
    let large = ledger(&Ledger { title: "t".into(), steps, width: Some(820.0), ..Ledger::default() });
    assert!(large.contains("sigma0"));
}

#[test]
fn a_ledger_without_lengths_says_why_it_has_no_check_points() {
    let step = LedgerStep { name: "s".into(), heldout_px: 1.0, check_mm: None, sigma0: 1.0 };
    let of = |without_lengths: bool| {
        ledger(&Ledger { steps: vec![step.clone(), step.clone()], without_lengths, ..Ledger::default() })
    };
    assert!(of(false).contains("The block has no check points."));
    assert!(of(true).contains("beside a mistake") && !of(true).contains("has no check points"));
}
