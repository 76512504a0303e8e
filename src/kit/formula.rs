//! An effect from its formula: the header that somebody would write by hand, of expressions and parameters.

use super::expression::{ExpressionError, translate};
use super::template::{File, NameError, capitalised, check_name, type_name};
use crate::effects::Stage;

/// The interior orientation, as the stages name it.
const INTERIOR: [&str; 12] = ["f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2"];
/// What the context knows: name, C++ text, and the need that a formula has then.
const CONTEXT: [(&str, &str, &str); 12] = [
    ("t", "context.flight_time_s", "kTime"),
    ("tau", "context.tau", "kTime"),
    ("T", "context.temperature_c", "kTemperature"),
    ("Tmean", "context.mean_temperature_c", "kTemperature"),
    ("vx", "context.velocity[0]", "kVelocity"),
    ("vy", "context.velocity[1]", "kVelocity"),
    ("vz", "context.velocity[2]", "kVelocity"),
    ("w", "context.width_px", ""),
    ("h", "context.height_px", ""),
    ("tau_order", "context.tau_order", ""),
    ("column", "context.column_px", ""),
    ("row", "context.row_px", ""),
];

/// A parameter of a formula.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// As the expressions name it.
    pub name: String,
    /// Unit, `1` for none.
    pub unit: String,
    /// How it gets its value.
    pub size: Size,
}

/// How a parameter gets its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// Estimated; nothing happens at zero.
    Estimated {
        /// A size met in practice.
        typical: f64,
        /// Largest plausible size, where that is known.
        most: Option<f64>,
    },
    /// Given by the user; this is the default.
    Given(f64),
}

/// Why there is no header of a formula.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FormulaError {
    /// A name that no effect can have.
    #[error(transparent)]
    Name(#[from] NameError),
    /// An expression without a meaning.
    #[error("{output} = {error}")]
    Expression {
        /// What it computes.
        output: String,
        /// What is wrong with it.
        error: ExpressionError,
    },
    /// Anything else, in words.
    #[error("{0}")]
    Other(String),
}

/// Names of the values that come in, and of those that a formula may change: `dx` is what it adds to `x`.
fn values(stage: Stage) -> (Vec<&'static str>, Vec<&'static str>) {
    let pose = ["r1", "r2", "r3", "X", "Y", "Z"];
    let point = vec!["X", "Y", "Z"];
    match stage {
        Stage::Image => ([&["x", "y"], &INTERIOR[..]].concat(), vec!["x", "y"]),
        Stage::Interior => ([&INTERIOR[..], &["r1", "r2", "r3"]].concat(), INTERIOR.to_vec()),
        Stage::Exposure => (pose.to_vec(), pose.to_vec()),
        Stage::Ray => (vec!["r1", "r2", "r3", "CX", "CY", "CZ", "X", "Y", "Z"], point),
        Stage::Position => (pose.to_vec(), point),
        Stage::Control | Stage::Frame => (point.clone(), point),
    }
}

/// A need that every effect of a stage has.
fn need(stage: Stage) -> Option<&'static str> {
    match stage {
        Stage::Position => Some("kGnss"),
        Stage::Control => Some("kControl"),
        Stage::Frame => Some("kVertical"),
        _ => None,
    }
}

/// A header in C++ of the expressions `formula`: pairs of what an expression computes (`dx`) and its text.
///
/// # Errors
/// [`FormulaError`].
pub fn cpp(
    name: &str,
    stage: Stage,
    formula: &[(String, String)],
    parameters: &[Parameter],
) -> Result<File, FormulaError> {
    check_name(name)?;
    let (inputs, outputs) = values(stage);
    parameters.iter().enumerate().try_for_each(|(k, own)| judge(own, &parameters[..k], &inputs))?;
    let of_context = !matches!(stage, Stage::Control | Stage::Frame);
    let mut needs: Vec<&str> = need(stage).into_iter().collect();
    let (mut functions, mut used) = (Vec::new(), vec![false; parameters.len()]);
    let mut look_up = |word: &str| {
        if let Some(k) = inputs.iter().position(|input| *input == word) {
            return Ok(format!("in[{k}]"));
        }
        if let Some(k) = parameters.iter().position(|own| own.name == word) {
            used[k] = true;
            return Ok(format!("theta[{k}]"));
        }
        if let Some((_, text, need)) = CONTEXT.iter().find(|(known, ..)| of_context && *known == word) {
            if !need.is_empty() && !needs.contains(need) {
                needs.push(need);
            }
            return Ok((*text).to_owned());
        }
        let context = CONTEXT.iter().filter(|_| of_context).map(|(known, ..)| *known);
        let known = inputs.iter().copied().chain(parameters.iter().map(|own| own.name.as_str())).chain(context);
        Err(format!(
            "`{word}` is not known at the {} stage; there are {}",
            stage.name(),
            known.collect::<Vec<_>>().join(", ")
        ))
    };
    let mut lines = vec![String::new(); outputs.len()];
    for (output, text) in formula {
        let known = || outputs.iter().map(|own| format!("d{own}")).collect::<Vec<_>>().join(", ");
        let place = output.strip_prefix('d').and_then(|changed| outputs.iter().position(|own| *own == changed));
        let place = place
            .ok_or_else(|| FormulaError::Other(format!("`{output}`: the {} stage has {}", stage.name(), known())))?;
        if !lines[place].is_empty() {
            return Err(FormulaError::Other(format!("`{output}` stands there twice")));
        }
        let refused = |error| FormulaError::Expression { output: output.clone(), error };
        let found = translate(text, &mut look_up).map_err(refused)?;
        found.functions.iter().for_each(|function| {
            if !functions.contains(function) {
                functions.push(*function)
            }
        });
        lines[place] = found.cpp;
    }
    if let Some(idle) = used.iter().position(|used| !used) {
        return Err(FormulaError::Other(format!("no expression has the parameter `{}`", parameters[idle].name)));
    }
    if !parameters.iter().any(|own| matches!(own.size, Size::Estimated { .. })) {
        return Err(FormulaError::Other("expected a parameter that is estimated: every one is given".into()));
    }
    let offset = inputs.len().min(match stage {
        Stage::Ray => 6,
        Stage::Position => 3,
        _ => 0,
    });
    let body: String = lines
        .iter()
        .enumerate()
        .map(|(k, line)| {
            let change = if line.is_empty() { String::new() } else { format!(" + {line}") };
            format!("    out[{k}] = in[{}]{change};\n", k + offset)
        })
        .collect();
    Ok(File { path: format!("{name}.h"), text: header(name, stage, formula, parameters, &needs, &functions, &body) })
}

/// Refuses a parameter that no header can have.
fn judge(own: &Parameter, before: &[Parameter], inputs: &[&str]) -> Result<(), FormulaError> {
    let name = &own.name;
    let refuse = |problem: &str| Err(FormulaError::Other(format!("parameter `{name}`: {problem}")));
    let is_word = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_word {
        return refuse("expected a name of letters, digits and _, a letter first");
    }
    let taken = name == "pi" || inputs.contains(&name.as_str()) || CONTEXT.iter().any(|(known, ..)| known == name);
    if taken || before.iter().any(|other| other.name == *name) {
        return refuse("the name is taken; expected another");
    }
    if own.unit.is_empty() || own.unit.chars().any(|c| c.is_control() || matches!(c, '"' | '\\')) {
        return refuse("expected a unit, `1` for none");
    }
    match own.size {
        Size::Given(value) if !value.is_finite() => refuse("expected a finite value"),
        Size::Estimated { typical, .. } if !(typical.is_finite() && typical != 0.0) => {
            refuse("expected a typical size that is finite and not zero")
        }
        Size::Estimated { typical, most: Some(most) } if !(most.is_finite() && most >= typical.abs()) => {
            refuse("expected a largest size that is finite and no less than the typical one")
        }
        _ => Ok(()),
    }
}

fn declared(own: &Parameter) -> String {
    let Parameter { name, unit, size } = own;
    match size {
        Size::Given(value) => format!("Given(\"{name}\", \"{unit}\", {value:?})"),
        Size::Estimated { typical, most } => {
            let plain = format!("Estimated(\"{name}\", \"{unit}\", Scope::kGlobal, 0.0, {typical:?})");
            match most {
                Some(most) => format!("UpTo({plain}, {most:?}, \"stated with the formula\")"),
                None => plain,
            }
        }
    }
}

fn header(
    name: &str,
    stage: Stage,
    formula: &[(String, String)],
    parameters: &[Parameter],
    needs: &[&str],
    functions: &[&str],
    body: &str,
) -> String {
    // Checked above: letters, digits, blanks, operators.
    let words = formula
        .iter()
        .map(|(output, text)| format!("{output} = {}", text.split_whitespace().collect::<Vec<_>>().join(" ")));
    let words = words.collect::<Vec<_>>().join(", ");
    let using = match functions {
        [] => String::new(),
        names => {
            format!("    using {};\n", names.iter().map(|name| format!("std::{name}")).collect::<Vec<_>>().join(", "))
        }
    };
    let context = if body.contains("context") { "context" } else { "/*context*/" };
    let declared: String = parameters.iter().map(|own| format!("      {},\n", declared(own))).collect();
    let needs: Vec<String> = needs.iter().map(|need| format!("Need::{need}")).collect();
    let (count, needs) = (needs.len(), needs.join(", "));
    let (stage, type_name) = (capitalised(stage), type_name(name));
    format!(
        "\
// {words}
//
//   misclosure effects build {name}.h -o {name}.so        compiles it
//   misclosure effects check {name}.so                    does it keep the laws?
//   misclosure improve BLOCK -o RUN --plugin {name}.so    is it what a block lacks?
#include \"effect.h\"

namespace misclosure {{

struct {type_name} {{
  static constexpr const char* id = \"{name}\";
  static constexpr Stage stage = Stage::k{stage};
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = \"Adds {words}.\";
  static constexpr const char* formula = \"{words}\";
  static constexpr const char* confused_with = \"\";
  static constexpr const char* source = \"a formula of the user's\";
  static constexpr Parameter parameters[] = {{
{declared}  }};
  static constexpr std::array<Need, {count}> needs = {{{needs}}};

  template <class T>
  static bool Apply(const Context& {context}, const T* in, const T* theta, T* out) {{
{using}{body}    return true;
  }}
}};
MISCLOSURE_EFFECT({type_name})

}}  // namespace misclosure
"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimated(name: &str) -> Parameter {
        Parameter { name: name.into(), unit: "px".into(), size: Size::Estimated { typical: 0.2, most: Some(2.0) } }
    }

    fn made(formula: &[(&str, &str)], parameters: &[Parameter]) -> Result<String, String> {
        let formula: Vec<(String, String)> = formula.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
        cpp("ripple", Stage::Image, &formula, parameters).map(|file| file.text).map_err(|error| error.to_string())
    }

    #[test]
    fn a_formula_becomes_a_header() {
        let period = Parameter { name: "p".into(), unit: "px".into(), size: Size::Given(300.0) };
        let text = made(&[("dx", "a*sin(2*pi*x/p)"), ("dy", "0")], &[estimated("a"), period]).unwrap();
        for line in [
            "    using std::sin;\n",
            "    out[0] = in[0] + (theta[0] * sin((((2.0 * 3.141592653589793) * in[0]) / theta[1])));\n",
            "    out[1] = in[1] + 0.0;\n",
            "Given(\"p\", \"px\", 300.0)",
            "struct RippleEffect {",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
    }

    #[test]
    fn a_formula_says_what_it_needs() {
        let text = made(&[("dx", "a*t")], &[estimated("a")]).unwrap();
        assert!(text.contains("std::array<Need, 1> needs = {Need::kTime}"), "{text}");
        assert!(text.contains("const Context& context"), "{text}");
    }

    #[test]
    fn what_no_header_can_have_is_refused() {
        for (formula, parameters, expected) in [
            (("dz", "a"), vec![estimated("a")], "`dz`: the image stage has dx, dy"),
            (("dx", "a*q"), vec![estimated("a")], "dx = `a*q`, character 3: `q` is not known at the image stage"),
            (("dx", "x"), vec![estimated("a")], "no expression has the parameter `a`"),
            (("dx", "x"), vec![], "expected a parameter that is estimated"),
            (("dx", "a"), vec![estimated("a"), estimated("a")], "parameter `a`: the name is taken"),
            (("dx", "f1"), vec![estimated("f\"")], "parameter `f\"`: expected a name of letters"),
        ] {
            let error = made(&[formula], &parameters).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
