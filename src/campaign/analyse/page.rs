//! The page of a campaign, and its tables in the terminal.

use super::super::gather::Row;
use super::{
    Anova, Calibration, Confusion, Curve, FalseAlarms, Power, QUANTILES, Reached, Share, anova, calibration, confusion,
    curves, false_alarms, power,
};
use crate::campaign::folder::State;
use crate::report::figures::{Axis, LineChart, LineStyle, Panel, Series, line_chart};
use crate::report::html::Page;
use crate::report::numbers::{percent, significant};
use crate::report::tables::Table;
use crate::score::power::POWER;

/// Effects whose p-values are drawn: those furthest from uniform.
const DRAWN: usize = 5;
/// Rows of the confusion that the page shows.
const SHOWN: usize = 200;

/// The tables of a campaign, in their order; `figure`: of the analysis of variance.
pub fn tables(rows: &[Row], figure: &str) -> Vec<Table> {
    let mut all = vec![states(rows)];
    all.extend(false_alarms(rows).map(|alarms| alarm_table(&alarms)));
    let (power, confusion, calibration) = (power(rows), confusion(rows), calibration(rows));
    if !power.is_empty() {
        all.push(power_table(&power));
        all.extend(curves(&power).map(|(size, curves)| reached_table(&size, &curves)));
    }
    if !confusion.is_empty() {
        all.push(confusion_table(&confusion));
    }
    if !calibration.is_empty() {
        all.push(calibration_table(&calibration));
    }
    all.extend(anova(rows, figure).map(|anova| anova_table(&anova)));
    all
}

/// The page.
pub fn page(rows: &[Row], about: &str, figure: &str) -> Page {
    let mut page = Page::new("A campaign");
    page.subtitle(about);
    for table in tables(rows, figure) {
        page.table(&table);
    }
    if let Some((size, curves)) = curves(&power(rows)) {
        let caption = "Power: share of the cases in which what is there is named. The table has the intervals.";
        page.section("Power").figure("power", power_curves(&size, &curves), caption);
    }
    let calibration = calibration(rows);
    if let Some(svg) = uniformity(&calibration) {
        let caption = "p-values of blocks without any cause: the share below p against p. On the line they are \
                       uniform; below it a test is cautious, above it a test is rash.";
        page.section("Calibration").figure("calibration", svg, caption);
    }
    page
}

fn states(rows: &[Row]) -> Table {
    let count = |is: fn(&State) -> bool| rows.iter().filter(|row| is(&row.state)).count().to_string();
    let mut table =
        Table::new("Cases").number("planned", "").number("done", "").number("failed", "").number("open", "");
    let open = |state: &State| matches!(state, State::Open | State::Taken);
    let failed = |state: &State| matches!(state, State::Failed(_));
    table.row([rows.len().to_string(), count(|state| *state == State::Done), count(failed), count(open)]);
    table
}

fn shares(share: Share) -> [String; 2] {
    let [low, high] = share.interval();
    [percent(share.value()), format!("{} to {}", percent(low), percent(high))]
}

fn alarm_table(alarms: &FalseAlarms) -> Table {
    let mut table = Table::new("Blocks with nothing to find").text("", "").number("blocks", "").number("share", "");
    table = table.text("95 % interval", "");
    for (what, share) in [("something is named", alarms.named), ("not adequate", alarms.not_adequate)] {
        let [value, interval] = shares(share);
        table.row([what.to_owned(), share.of.to_string(), value, interval]);
    }
    table
}

fn power_table(all: &[Power]) -> Table {
    let mut table = Table::new("Power: how often what is there is named");
    let factors: Vec<&String> = all.first().map_or_else(Vec::new, |own| own.levels.keys().collect());
    for factor in &factors {
        table = table.text(factor, "");
    }
    table = table.text("there", "").number("cases", "").number("anything named", "").number("named", "");
    table = table.text("95 % interval", "").number("named alone", "");
    for own in all {
        let [named, interval] = shares(own.named);
        let levels = factors.iter().map(|factor| own.levels[*factor].clone());
        let counts = [own.expected.join(" + "), own.named.of.to_string(), percent(own.seen.value())];
        table.row(levels.chain(counts).chain([named, interval, percent(own.right.value())]));
    }
    table
}

fn confusion_table(all: &[Confusion]) -> Table {
    let mut table = Table::new("Confusion").text("there", "").text("named", "").number("cases", "");
    for own in all.iter().take(SHOWN) {
        table.row([own.expected.clone(), own.said.clone(), own.count.to_string()]);
    }
    if all.len() > SHOWN {
        table.note(format!("{} rarer answers are left out here; results.csv has every case.", all.len() - SHOWN));
    }
    table
}

fn calibration_table(all: &[Calibration]) -> Table {
    let mut table = Table::new("p-values of blocks with nothing to find").text("effect", "").number("p-values", "");
    for q in QUANTILES {
        table = table.number(&format!("below {q}"), "");
    }
    table = table.number("D", "").number("p of D", "");
    for own in all {
        let (distance, p) = own.kolmogorov_smirnov;
        let below = own.below.iter().map(|share| significant(*share, 3));
        let ends = [significant(distance, 3), significant(p, 2)];
        table.row([own.effect.clone(), own.count.to_string()].into_iter().chain(below).chain(ends));
    }
    table.note("D: largest distance from the uniform distribution (Kolmogorov and Smirnov).");
    table
}

fn anova_table(anova: &Anova) -> Table {
    let caption = format!("Analysis of variance of {} over {} cases", anova.figure, anova.count);
    let mut table = Table::new(caption).text("factor", "").number("sum of squares", "").number("dof", "");
    table = table.number("F", "").number("p", "").text("means by level", "");
    for source in &anova.sources {
        let means = source.means.iter().map(|(level, mean)| format!("{level}: {}", significant(*mean, 3)));
        let numbers = [significant(source.squares, 3), source.dof.to_string(), significant(source.f, 3)];
        let ends = [significant(source.p_value, 2), means.collect::<Vec<_>>().join(", ")];
        table.row([source.factor.clone()].into_iter().chain(numbers).chain(ends));
    }
    let (squares, dof) = anova.residual;
    table.row(["(rest)".to_owned(), significant(squares, 3), dof.to_string()]);
    table.note(format!("The factors explain {} of the variation.", percent(anova.explained)));
    table
}

fn reached_table(size: &str, curves: &[Curve]) -> Table {
    let mut table = Table::new(format!("{size} from which {} are named", percent(POWER)));
    table = table.text("there", "").text("others", "").number("from", "").text("largest tried", "");
    for curve in curves {
        let tried = curve.points.iter().map(|(size, _)| *size);
        let [least, most] = [tried.clone().fold(f64::MAX, f64::min), tried.fold(f64::MIN, f64::max)];
        let from = match curve.reaches(POWER) {
            Reached::BelowAll => format!("below {least}"),
            Reached::At(size) => significant(size, 2),
            Reached::BeyondAll => format!("above {most}"),
        };
        let share =
            curve.points.last().map_or(String::new(), |(size, share)| format!("{size}: {}", percent(share.value())));
        // The level that names what is there says it twice.
        let others = curve.levels.iter().filter(|level| **level != curve.expected);
        let others = others.map(String::as_str).collect::<Vec<_>>().join(", ");
        table.row([curve.expected.clone(), others, from, share]);
    }
    table
}

/// A panel for each thing to find, with a curve for each combination of the other factors.
fn power_curves(size: &str, curves: &[Curve]) -> String {
    let mut panels: Vec<(&str, Vec<&Curve>)> = Vec::new();
    for curve in curves {
        match panels.iter_mut().find(|(expected, _)| *expected == curve.expected) {
            Some((_, own)) => own.push(curve),
            None => panels.push((&curve.expected, vec![curve])),
        }
    }
    let is_log = curves.iter().flat_map(|curve| &curve.points).all(|(size, _)| *size > 0.0);
    let columns = panels.len().min(3);
    let panels = panels.into_iter().map(|(expected, own)| {
        // A level that all curves of a panel share tells nothing there.
        let tells = |k: &usize| own.iter().any(|curve| curve.levels[*k] != own[0].levels[*k]);
        let telling: Vec<usize> = (0..own[0].levels.len()).filter(tells).collect();
        let label = |curve: &Curve| telling.iter().map(|k| curve.levels[*k].as_str()).collect::<Vec<_>>().join(", ");
        let points = |curve: &Curve| curve.points.iter().map(|(size, share)| [*size, share.value()]).collect();
        Panel {
            title: expected.to_owned(),
            x: Axis { log: is_log, ..Axis::new(size, "") },
            y: Axis::new("named", "").range(0.0, 1.0),
            series: own.iter().map(|curve| Series::new(label(curve), points(curve))).collect(),
        }
    });
    line_chart(&LineChart { panels: panels.collect(), columns, ..LineChart::default() })
}

fn uniformity(all: &[Calibration]) -> Option<String> {
    let mut furthest: Vec<&Calibration> = all.iter().collect();
    furthest.sort_by(|a, b| a.kolmogorov_smirnov.1.total_cmp(&b.kolmogorov_smirnov.1));
    let curve = |own: &&Calibration| {
        let n = own.sorted.len();
        let points = own.sorted.iter().enumerate().map(|(k, p)| [*p, (k + 1) as f64 / n as f64]).collect();
        Series::new(own.effect.clone(), points).style(LineStyle::Line)
    };
    let mut series = vec![Series::new("uniform", vec![[0.0, 0.0], [1.0, 1.0]]).style(LineStyle::Dashed)];
    series.extend(furthest.iter().take(DRAWN).map(curve));
    let side = |label: &str| Axis { range: Some([0.0, 1.0]), ..Axis::new(label, "") };
    let panel = Panel { x: side("p"), y: side("share below"), series, ..Panel::default() };
    (!all.is_empty()).then(|| line_chart(&LineChart { panels: vec![panel], columns: 1, ..LineChart::default() }))
}
