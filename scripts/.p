#!/bin/sh
# Makes all packages in dist/: Debian package, archive, Python wheel and sdist, SBOM, notices of others, checksums.
#
#   scripts/package      needs Rust, a C compiler, dpkg-dev, xz and Python's venv; tools of cargo are built into target/tools
set -eu
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$*" >&2; "$@"; }
for program in cc dpkg-shlibdeps git gzip python3 sha256sum strip xz; do
    command -v "$program" >/dev/null || { echo "scripts/package: \`$program\` is missing (Debian: apt-get install gcc dpkg-dev git python3-venv xz-utils)" >&2; exit 1; }
done
# Unoptimised, as they are built only once: but for the one that compares texts.
tool() { CARGO_TARGET_DIR=target/tools/build step cargo install --locked --debug --quiet --root target/tools "$@"; }
export PATH="$PWD/target/tools/bin:$PATH"
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

step cargo deny --config scripts/packaging/deny.toml check bans licenses sources
binary=target/dist/parallax
strip $binary # the profile leaves names of functions where cargo-auditable builds
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
made=target/packaging
rm -rf dist "$made" && mkdir -p dist

# What the Debian package and the archive hold beside the executable, where Debian puts it.
root=$made/root share=$made/root/usr/share doc=$made/root/usr/share/doc/parallax
mkdir -p "$share/bash-completion/completions" "$share/zsh/vendor-completions" "$share/fish/vendor_completions.d" "$doc" \
    "$root/usr/lib/systemd/system" "$root/etc/parallax" "$share/lintian/overrides"
$binary completions bash >"$share/bash-completion/completions/parallax"
$binary completions zsh >"$share/zsh/vendor-completions/_parallax"
$binary completions fish >"$share/fish/vendor_completions.d/parallax.fish"
$binary man "$share/man/man1" --quiet
cp scripts/packaging/parallax@.service "$root/usr/lib/systemd/system/"
cp scripts/packaging/lintian-overrides "$share/lintian/overrides/parallax"
cp scripts/packaging/demo.toml "$root/etc/parallax/"
cp configs/rigs/humaneva-s1.toml "$root/etc/parallax/demo-rig.toml"
# Pages, and the examples that they name, without the models, which are built in.
git archive HEAD README.md LICENSE-APACHE LICENSE-MIT docs configs | tar -x -C "$doc"
find "$doc/configs/models" -type f ! -name '*.md' -delete
step cargo about generate --frozen --manifest-path services/parallax/Cargo.toml --config scripts/packaging/about.toml \
    --output-file "$doc/third-party-notices" scripts/packaging/notices.hbs
gzip -9n "$doc/third-party-notices"
# The tool writes one beside every manifest.
step cargo cyclonedx --quiet --manifest-path services/parallax/Cargo.toml --format json --spec-version 1.5 --no-build-deps --override-filename sbom
sed "s|path+file://$PWD/||g" services/parallax/sbom.json >"dist/parallax-$version.cdx.json"
rm -f services/*/sbom.json shared/*/sbom.json tests/sbom.json

date=$(date -u -R -d "@$SOURCE_DATE_EPOCH")
printf 'parallax (%s-1) unstable; urgency=medium\n\n  * docs/changelog.md in this folder has what changed.\n\n -- %s  %s\n' \
    "$version" "$(sed -n 's/^maintainer = "\(.*\)"/\1/p' services/parallax/Cargo.toml)" "$date" >"$made/changelog"
step cargo deb --quiet --manifest-path services/parallax/Cargo.toml --no-build --no-strip --compress-system --profile dist --output dist/

name=parallax-$version-x86_64-linux
mkdir -p "$made/$name/bin"
cp "$binary" "$made/$name/bin/"
cp -r "$share" "$made/$name/"
cp scripts/packaging/copyright "$made/$name/share/doc/parallax/"
cp LICENSE-APACHE LICENSE-MIT "dist/parallax-$version.cdx.json" "$made/$name/"
step tar --create --xz --file "dist/$name.tar.xz" --directory "$made" --sort=name --mtime="@$SOURCE_DATE_EPOCH" \
    --owner=0 --group=0 --numeric-owner "$name"

# From a copy, as building a wheel writes beside its source.
python3 -m venv target/packaging/venv
target/packaging/venv/bin/pip install --quiet build
cp -r python target/packaging/python
step target/packaging/venv/bin/python -m build --outdir dist target/packaging/python >target/packaging/python.log

(cd dist && sha256sum ./* >SHA256SUMS)
ls -l dist
