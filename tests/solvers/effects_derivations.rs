//! Every effect has two derivations: one formula in C++ (derivatives by Jets), one in Rust (derivatives by hand). They
//! describe the same thing, and give the same values and derivatives at random places.

use misclosure::adjust::ceres::{cpp_descriptors, cpp_eval};
use misclosure::effects::laws::{SAMPLES, Sample};
use misclosure::effects::{Context, Descriptor, Effect, Parameter, catalogue};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Of an output, by the largest over all places: a chain of a hundred operations keeps 1e-13.
const VALUE_REL: f64 = 1e-13;
/// Of an entry of a derivative, by its column's largest over all places; a digit is left to differences of near values.
const DERIVATIVE_REL: f64 = 1e-12;

fn evaluate(effect: &dyn Effect, context: &Context<'_>, sample: &Sample) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let stage = effect.descriptor().stage;
    let (n, m, p) = (stage.inputs(), stage.outputs(), sample.theta.len());
    let (mut out, mut d_input, mut d_theta) = (vec![0.0; m], vec![0.0; m * n], vec![0.0; m * p]);
    effect
        .eval(context, &sample.input, &sample.theta, &mut out, Some(&mut d_input), Some(&mut d_theta))
        .unwrap_or_else(|error| panic!("{}: {error}", effect.descriptor().id));
    (out, d_input, d_theta)
}

/// Largest entry of each column of row-major matrices.
fn column_sizes(matrices: &[Vec<f64>], columns: usize) -> Vec<f64> {
    let mut sizes = vec![0.0f64; columns];
    for matrix in matrices {
        matrix.iter().enumerate().for_each(|(k, value)| sizes[k % columns] = sizes[k % columns].max(value.abs()));
    }
    sizes
}

/// Largest difference of two lists of matrices, by the size of the column.
fn difference(a: &[Vec<f64>], b: &[Vec<f64>], columns: usize) -> f64 {
    let sizes = column_sizes(a, columns);
    let mut worst = 0.0f64;
    for (a, b) in a.iter().zip(b) {
        assert_eq!(a.len(), b.len());
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            let difference = if a == b { 0.0 } else { (a - b).abs() / sizes[k % columns] };
            assert!(!difference.is_nan(), "{a} and {b}");
            worst = worst.max(difference);
        }
    }
    worst
}

#[test]
fn values_and_derivatives_agree() {
    let mut failed = Vec::new();
    for (number, effect) in catalogue().iter().enumerate() {
        let descriptor = effect.descriptor();
        let mut random = ChaCha8Rng::seed_from_u64(7000 + number as u64);
        let (mut rust, mut cpp) = ([Vec::new(), Vec::new(), Vec::new()], [Vec::new(), Vec::new(), Vec::new()]);
        for _ in 0..SAMPLES {
            let sample = Sample::draw(descriptor, &mut random);
            let context = sample.context();
            let (value, d_input, d_theta) = evaluate(*effect, &context, &sample);
            let other = cpp_eval(&descriptor.id, &context, &sample.input, &sample.theta)
                .unwrap_or_else(|error| panic!("{}: {error}", descriptor.id));
            for (list, found) in rust.iter_mut().zip([value, d_input, d_theta]) {
                list.push(found);
            }
            for (list, found) in cpp.iter_mut().zip([other.0, other.1, other.2]) {
                list.push(found);
            }
        }
        let (outputs, inputs) = (descriptor.stage.outputs(), descriptor.stage.inputs());
        let value = difference(&rust[0], &cpp[0], outputs);
        let d_input = difference(&rust[1], &cpp[1], inputs);
        let d_theta = difference(&rust[2], &cpp[2], descriptor.parameters.len());
        let line =
            format!("{:<20} value {value:.1e}, by input {d_input:.1e}, by parameters {d_theta:.1e}", descriptor.id);
        println!("{line}");
        if value > VALUE_REL || d_input > DERIVATIVE_REL || d_theta > DERIVATIVE_REL {
            failed.push(line);
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// What solvers, tests and scans rely on; the texts of the two may differ, and only Rust knows what is plausible.
fn contract(descriptor: &Descriptor) -> String {
    let Descriptor { id, stage, kind, parameters, needs, .. } = descriptor;
    let parameters: Vec<Parameter> = parameters.iter().map(|p| Parameter { plausible: None, ..p.clone() }).collect();
    format!("{id}: {stage:?}, {kind:?}, needs {needs:?}, {parameters:?}")
}

#[test]
fn descriptors_agree() {
    let in_cpp = cpp_descriptors().expect("the tables of C++");
    let mut cpp: Vec<String> = in_cpp.iter().map(contract).collect();
    let mut rust: Vec<String> = catalogue().iter().map(|effect| contract(effect.descriptor())).collect();
    cpp.sort();
    rust.sort();
    let pairs = rust.iter().zip(&cpp).filter(|(a, b)| a != b);
    let text: Vec<String> = pairs.map(|(a, b)| format!("Rust {a}\nC++  {b}")).collect();
    assert!(text.is_empty() && rust.len() == cpp.len(), "{}", text.join("\n"));
}
