//! A lens that warms up after take-off: the focal length runs towards its value in the heat, in every flight anew.
//!
//!   misclosure effects build examples/rust-effect -o lens-warm-up.so
//!   misclosure effects check lens-warm-up.so
//!   misclosure improve BLOCK -o RUN --plugin lens-warm-up.so
//!
//! `misclosure effects new NAME --stage interior --rust` begins such a package.

#[path = "../../../rust/effect.rs"] // a package of your own has a copy beside lib.rs
mod effect;

use effect::*;

struct LensWarmUp;

impl Effect for LensWarmUp {
    const ID: &CStr = c"lens-warm-up";
    const STAGE: Stage = Stage::Interior;
    const KIND: Kind = Kind::Physical;
    const SUMMARY: &CStr =
        c"The lens warms up after the first image of each flight, ever more slowly, and its focal length with it.";
    const FORMULA: &CStr = c"f += a (1 - exp(-t / lag)), t since the first image of the flight";
    const CONFUSED_WITH: &CStr =
        c"focal-time: a drift that does not slow down; focal-temperature, where temperatures were recorded.";
    const SOURCE: &CStr = c"Newton's law of cooling; Daakir et al. 2019 for the size";
    const PARAMETERS: &[Parameter] = &[
        Parameter::estimated(c"a", c"px", Scope::Global, 0.0, 5.0)
            .up_to(100.0, c"30 K of warming at 3 px/K (Daakir et al. 2019)"),
        Parameter::given(c"lag", c"s", 120.0),
    ];
    const NEEDS: &[Need] = &[Need::Time];
    const WORDS: Option<Words> = Some(Words {
        what: c"The lens warms up after take-off, first fast and then slowly, and its focal length changes with it. \
                Images from the first minutes of a flight then have another scale than the rest.",
        remedy: c"Let the camera run for some minutes before the flight, or model it.",
        tell: c"a recorded temperature, or a flight with a warm camera",
    });
    const PICTURE: Picture = Picture::Scale(By::Time);

    fn apply<T: Number>(context: &Context, input: &[T], theta: &[T], out: &mut [T]) -> bool {
        out.copy_from_slice(&input[..12]);
        let elapsed = -T::from(context.flight_time_s) / theta[1];
        out[0] = input[0] + theta[0] * (T::from(1.0) - elapsed.exp());
        theta[1].value() > 0.0
    }
}
plugin!(LensWarmUp);
