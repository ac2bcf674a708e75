// SPDX-License-Identifier: Apache-2.0
#include "client/io/conversion.h"

#include <array>
#include <initializer_list>

namespace shapedb::io {

namespace {

struct Conversion {
    std::initializer_list<std::string_view> endings;
    const char* advice;
};

}  // namespace

std::string conversionAdvice(std::string_view ending) {
    // Also in docs/file-formats.md.
    const std::array<Conversion, 6> conversions = {{
        {{".laz"}, "LAZ is unpacked by 'laszip -i IN.laz -o OUT.las' or 'pdal translate IN.laz OUT.las'"},
        {{".e57", ".ptx", ".fls", ".rcp", ".rcs", ".zfs"},
         "scans of this format are converted by CloudCompare or the scanner's program, to PLY or LAS"},
        {{".dae", ".fbx", ".3ds", ".blend", ".wrl", ".x3d", ".usd", ".usdz", ".amf", ".dxf", ".lwo", ".ase"},
         "models of this format are converted by Blender, or 'assimp export IN OUT.ply'"},
        {{".step", ".stp", ".iges", ".igs", ".brep", ".fcstd", ".sldprt", ".ipt", ".catpart"},
         "solids of CAD programs are exported as STL by them, or by FreeCAD"},
        {{".vtk", ".vtp", ".vtu", ".msh", ".mesh", ".gts", ".xdmf"},
         "meshes of this format are converted by ParaView, or 'meshio convert IN OUT.ply'"},
        {{".zip", ".tar", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst"}, "unpack it first"},
    }};
    for (const Conversion& conversion : conversions) {
        for (const std::string_view known : conversion.endings) {
            if (ending == known) return conversion.advice;
        }
    }
    return {};
}

}  // namespace shapedb::io
