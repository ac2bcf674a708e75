#include "server/security/operation.h"

namespace shapedb::security {

const char* roleName(Role role) noexcept {
    switch (role) {
        case Role::kReader: return "reader";
        case Role::kWriter: return "writer";
        case Role::kAdmin: return "admin";
    }
    return "unknown";
}

}  // namespace shapedb::security
