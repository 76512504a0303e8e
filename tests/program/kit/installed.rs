//! The package serves other ways of building, too: CMake, pkg-config, cargo, the first lines of the header.

use super::place::{Place, Run, example, prefix, root};
use misclosure::kit::{headers, reference};
use std::fs;

/// CMake finds the package and makes the plug-in of a header.
#[test]
fn cmake_builds_a_plug_in() {
    let place = Place::new();
    place.write("mount-vibration.h", &example("mount-vibration.h"));
    place.write(
        "CMakeLists.txt",
        "cmake_minimum_required(VERSION 3.22)\nproject(mine CXX)\nfind_package(misclosure 0.1 REQUIRED)\n\
         misclosure_add_effect(mount-vibration mount-vibration.h)\n",
    );
    let found = format!("-DCMAKE_PREFIX_PATH={}", prefix().display());
    for arguments in [vec!["-S", ".", "-B", "build", &found], vec!["--build", "build"]] {
        let output = place.command("cmake").args(&arguments).output().expect("CMake");
        let run = Run::of(output);
        assert_eq!(run.code, Some(0), "{arguments:?}: {}{}", run.text, run.errors);
    }
    let checked = place.json("effects check build/mount-vibration.so");
    assert_eq!((&checked["holds"], &checked["effect"]), (&true.into(), &"mount-vibration".into()), "{checked}");
}

/// pkg-config names what a compiler needs.
#[test]
fn pkg_config_names_the_header() {
    let place = Place::new();
    place.write("sensor-pattern.h", &example("sensor-pattern.h"));
    let mut command = place.command("sh");
    command.args(["-c", "c++ -std=c++17 -fsyntax-only -x c++ sensor-pattern.h $(pkg-config --cflags misclosure)"]);
    let run = Run::of(command.env("PKG_CONFIG_PATH", prefix().join("lib/pkgconfig")).output().expect("a shell"));
    assert_eq!((run.code, run.errors.as_str()), (Some(0), ""));
}

/// What is installed is what the program itself compiles against, and the template's copy of the Rust contract is of
/// the same version.
#[test]
fn headers_are_those_of_the_program() {
    for (name, text) in headers::HEADERS {
        let installed = fs::read_to_string(prefix().join("include/misclosure").join(name)).expect("a header");
        assert_eq!(installed, text, "{name}");
    }
    let rust = fs::read_to_string(root().join("rust/effect.rs")).expect("the contract in Rust");
    let version = misclosure::effects::abi::ABI_VERSION;
    assert!(rust.contains(&format!("pub const ABI_VERSION: u32 = {version};")));
}

/// The reference page is that of the header.
#[test]
fn the_reference_page_is_current() {
    let page = fs::read_to_string(root().join("docs/effect-header.md")).expect("the page");
    assert!(
        page == reference::page(),
        "docs/effect-header.md is not that of cpp/effect.h: misclosure effects reference > docs/effect-header.md"
    );
    for word in [
        "misclosure_context",
        "## Stage",
        "kExposure",
        "surveyed_kind",
        "## Scope",
        "kImage",
        "`Parameter Estimated",
        "null law",
    ] {
        assert!(page.contains(word), "{word}");
    }
}
