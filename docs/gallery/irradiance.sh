#!/bin/sh
# The comparisons of docs/gallery/irradiance.md: sh docs/gallery/irradiance.sh [PART...]
# Parts: 1700 256 progressive 500 1000 5000 dark sponza. HALFLIGHT_SCENES names the folder that has
# sponza-dabrovic, which is not part of this repository. SPONZA="--size 320x240 --records 4000" makes that part smaller.
set -eu
cd "$(dirname "$0")/../.."
study() {
    printf '\n%s\n' "cargo lab study irradiance $*"
    cargo lab study irradiance "$@"
}
box() {
    scene=$1
    shift
    study "scenes/cornell/$scene.obj" --eye 278,273,-800 --look-at 278,273,279 --fov 37.5 --max-depth 3 --points 4000 "$@"
}
for part in ${*:-1700 256 progressive 500 1000 5000 dark sponza}; do
    case $part in
    1700) box cornell --records 1700 --cache-rays 4096 ;;
    256) box cornell --records 1700 --cache-rays 256 ;;
    progressive)
        box cornell --records 1700 --cache-rays 4096 --progressive --metrics bounded-split-sphere,occlusion-hessian,halflight
        ;;
    500 | 1000) box cornell --records "$part" --cache-rays 4096 ;;
    5000) box cornell --records 5000 --cache-rays 4096 --metrics bounded-split-sphere,occlusion-hessian,halflight ;;
    dark) box dark-wall --records 1700 --cache-rays 1024 --metrics bounded-split-sphere,geometric-hessian,occlusion-hessian,halflight ;;
    sponza)
        study "$HALFLIGHT_SCENES/sponza-dabrovic/sponza-dabrovic.obj" --eye -3,1.2,-1.5 --look-at 2.5,1.9,4 --fov 50 \
            ${SPONZA:---size 960x720 --records 32000} --max-depth 3 --cache-rays 256 --points 300 \
            --metrics halflight,occlusion-hessian,bounded-split-sphere
        ;;
    *) echo "no part $part" >&2 && exit 2 ;;
    esac
done
