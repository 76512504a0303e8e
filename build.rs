//! Builds the C++ side: the solver library with CMake, the bridge with cxx. Embeds the page of the laboratory.

fn main() {
    for path in ["cpp", "src/adjust/ceres/bridge.rs", "web"] {
        println!("cargo::rerun-if-changed={path}");
    }
    if let Err(error) = embed_page() {
        println!("cargo::error=web: {error}");
        return;
    }
    if let Err(missing) = find_packages() {
        println!("cargo::error={missing}");
        return;
    }
    let solver = cmake::Config::new("cpp")
        .profile("Release")
        .define("BUILD_TESTING", "OFF")
        .build_target("misclosure_solver")
        .build();

    // Dependents first: the linker reads from left to right.
    cxx_build::bridge("src/adjust/ceres/bridge.rs")
        .file("cpp/bridge.cc")
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

/// Endings of what belongs to the page of the laboratory.
const PAGE: [&str; 6] = ["html", "js", "css", "svg", "png", "txt"];

/// A table of the page's files, by their path below `web`, for `src/lab/assets.rs`.
fn embed_page() -> std::io::Result<()> {
    let root = std::path::PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default()).join("web");
    let mut folders = vec![root.clone()];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if PAGE.contains(&ending) {
                files.push(path);
            }
        }
    }
    files.sort();
    let row = |path: &std::path::PathBuf| {
        let name = path.strip_prefix(&root).unwrap_or(path).to_string_lossy().replace('\\', "/");
        format!("    ({name:?}, include_bytes!({:?})),\n", path.display().to_string())
    };
    let rows: String = files.iter().map(row).collect();
    let table = format!("/// Every file of the page.\nstatic ASSETS: &[(&str, &[u8])] = &[\n{rows}];\n");
    let out = std::path::PathBuf::from(std::env::var("OUT_DIR").unwrap_or_default());
    std::fs::write(out.join("assets.rs"), table)
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
            ["/usr/include", "/usr/local/include"].iter().any(|root| std::path::Path::new(root).join(header).exists());
        if !found {
            return Err(format!("`{header}` not found: install {package} (`make setup` does)"));
        }
    }
    Ok(())
}
