//! Exports what takes the C library's place; builds the C++ side where the feature `ceres` asks for it.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        // Libraries that the program loads find ours (src/faults.rs), not the C library's.
        for symbol in ["_exit", "_Exit", "exit", "quick_exit"] {
            println!("cargo::rustc-link-arg-bins=-Wl,--export-dynamic-symbol={symbol}");
        }
    }
    #[cfg(feature = "ceres")]
    ceres::build();
}

/// The solver library with CMake, the bridge with cxx.
#[cfg(feature = "ceres")]
mod ceres {
    use std::path::PathBuf;

    pub fn build() {
        for path in ["cpp", "src/adjust/ceres/bridge.rs"] {
            println!("cargo::rerun-if-changed={path}");
        }
        if let Err(missing) = find_packages() {
            println!("cargo::error={missing}");
            return;
        }
        // Lints and builds run this script each for itself, with a folder each; the library takes minutes and is made
        // in one for both.
        let own_folder = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
        let of_profile = own_folder.ancestors().nth(3).expect("target/PROFILE/build/PACKAGE/out");
        let solver = cmake::Config::new("cpp")
            .out_dir(of_profile.join("misclosure-solver"))
            .profile("Release")
            .define("BUILD_TESTING", "OFF")
            .build_target("misclosure_solver")
            .build();

        // Dependents first: the linker reads from left to right.
        cxx_build::bridge("src/adjust/ceres/bridge.rs")
            .file("cpp/bridge.cc")
            .file("cpp/exceptions.cc")
            .include("cpp")
            .include("/usr/include/eigen3")
            .std("c++17")
            .opt_level(2)
            .compile("misclosure_bridge");
        println!("cargo::rustc-link-search=native={}", solver.join("build").display());
        println!("cargo::rustc-link-lib=static=misclosure_solver");
        for library in ["ceres", "glog", "cholmod"] {
            println!("cargo::rustc-link-lib=dylib={library}");
        }
    }

    /// CMake's own message on a missing Ceres is a page long; this one says what to install.
    fn find_packages() -> Result<(), String> {
        let needed = [
            ("ceres/ceres.h", "libceres-dev"),
            ("suitesparse/cholmod.h", "libsuitesparse-dev"),
            ("eigen3/Eigen/Core", "libeigen3-dev"),
        ];
        for (header, package) in needed {
            let found =
                ["/usr/include", "/usr/local/include"].iter().any(|root| PathBuf::from(root).join(header).exists());
            if !found {
                return Err(format!(
                    "`{header}` not found: install {package} (`make setup` does), \
                     or build without Ceres: --no-default-features --features lab"
                ));
            }
        }
        Ok(())
    }
}
