// SPDX-License-Identifier: GPL-3.0-or-later
// Every operation of the API, with the role it takes and the kind of work it is. A handler of any transport
// names its operation here; there is no other way to run one.
#pragma once

#include <array>
#include <cstdint>

namespace shapedb::security {

/// What a caller may do; each includes the ones before it.
enum class Role : std::uint8_t {
    kReader,  ///< read, search and compare
    kWriter,  ///< add, change and delete shapes
    kAdmin,   ///< create and delete collections, rebuild, back up, restore, keys
};

/// Which share of the threads a call may take, so that no kind of call can shut the others out.
enum class CallClass : std::uint8_t {
    kOrdinary,   ///< one request, and an answer as soon as it is computed
    kUpload,     ///< lasts as long as the client sends
    kAdmin,      ///< has slots of its own
    kAdminLong,  ///< long-running administration: may not use all of these slots
};

/// What of the server a call touches: a key may be for some collections only.
enum class Scope : std::uint8_t {
    kCollections,  ///< the collections it names, of which the key must have each
    kNone,         ///< none, or optional: the handler asks for the collection
    kServer,       ///< all collections: needs a key of all
    kKeys,         ///< the API keys: as kServer, and never without a key
};

struct Operation {
    const char* service;  ///< as in proto/, without the package
    const char* name;     ///< as in proto/
    Role role;
    CallClass callClass;
    Scope scope;
};

namespace operations {

// ShapeService
inline constexpr Operation kAddShape{"ShapeService", "AddShape", Role::kWriter, CallClass::kUpload,
                                     Scope::kCollections};
inline constexpr Operation kGetShape{"ShapeService", "GetShape", Role::kReader, CallClass::kOrdinary,
                                     Scope::kCollections};
inline constexpr Operation kGetShapes{"ShapeService", "GetShapes", Role::kReader, CallClass::kOrdinary,
                                      Scope::kCollections};
inline constexpr Operation kGetPoints{"ShapeService", "GetPoints", Role::kReader, CallClass::kOrdinary,
                                      Scope::kCollections};
inline constexpr Operation kGetPreviews{"ShapeService", "GetPreviews", Role::kReader, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kListShapes{"ShapeService", "ListShapes", Role::kReader, CallClass::kOrdinary,
                                       Scope::kCollections};
inline constexpr Operation kCountShapes{"ShapeService", "CountShapes", Role::kReader, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kCountByValue{"ShapeService", "CountByValue", Role::kReader, CallClass::kOrdinary,
                                         Scope::kCollections};
inline constexpr Operation kDeleteShape{"ShapeService", "DeleteShape", Role::kWriter, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kDeleteShapes{"ShapeService", "DeleteShapes", Role::kWriter, CallClass::kOrdinary,
                                         Scope::kCollections};
inline constexpr Operation kUpdateMetadata{"ShapeService", "UpdateMetadata", Role::kWriter,
                                           CallClass::kOrdinary, Scope::kCollections};
inline constexpr Operation kRetryShapes{"ShapeService", "RetryShapes", Role::kWriter, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kWatchIngest{"ShapeService", "WatchIngest", Role::kReader, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kGetSignature{"ShapeService", "GetSignature", Role::kReader, CallClass::kOrdinary,
                                         Scope::kCollections};
inline constexpr Operation kGetSegments{"ShapeService", "GetSegments", Role::kReader, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kSegment{"ShapeService", "Segment", Role::kReader, CallClass::kUpload,
                                    Scope::kNone};

// SearchService
inline constexpr Operation kSearchByKey{"SearchService", "SearchByKey", Role::kReader, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kSearchByScan{"SearchService", "SearchByScan", Role::kReader, CallClass::kUpload,
                                         Scope::kCollections};
inline constexpr Operation kSearchByScanInStages{"SearchService", "SearchByScanInStages", Role::kReader,
                                                 CallClass::kUpload, Scope::kCollections};
inline constexpr Operation kSearchBySignature{"SearchService", "SearchBySignature", Role::kReader,
                                              CallClass::kOrdinary, Scope::kCollections};
inline constexpr Operation kSearchBatch{"SearchService", "SearchBatch", Role::kReader, CallClass::kOrdinary,
                                        Scope::kCollections};
inline constexpr Operation kCompare{"SearchService", "Compare", Role::kReader, CallClass::kOrdinary,
                                    Scope::kCollections};

// AlignService
inline constexpr Operation kAlign{"AlignService", "Align", Role::kReader, CallClass::kUpload, Scope::kNone};

// CollectionService
inline constexpr Operation kCreateCollection{"CollectionService", "CreateCollection", Role::kAdmin,
                                             CallClass::kOrdinary, Scope::kCollections};
inline constexpr Operation kGetCollection{"CollectionService", "GetCollection", Role::kReader,
                                          CallClass::kOrdinary, Scope::kCollections};
inline constexpr Operation kListCollections{"CollectionService", "ListCollections", Role::kReader,
                                            CallClass::kOrdinary, Scope::kNone};
inline constexpr Operation kDeleteCollection{"CollectionService", "DeleteCollection", Role::kAdmin,
                                             CallClass::kOrdinary, Scope::kCollections};
inline constexpr Operation kRenameCollection{"CollectionService", "RenameCollection", Role::kAdmin,
                                             CallClass::kOrdinary, Scope::kCollections};
inline constexpr Operation kSetAlias{"CollectionService", "SetAlias", Role::kAdmin, CallClass::kOrdinary,
                                     Scope::kCollections};
inline constexpr Operation kDeleteAlias{"CollectionService", "DeleteAlias", Role::kAdmin,
                                        CallClass::kOrdinary, Scope::kCollections};

// AdminService
inline constexpr Operation kRebuild{"AdminService", "Rebuild", Role::kAdmin, CallClass::kAdminLong,
                                    Scope::kCollections};
inline constexpr Operation kCancelRebuild{"AdminService", "CancelRebuild", Role::kAdmin, CallClass::kAdmin,
                                          Scope::kCollections};
inline constexpr Operation kBackup{"AdminService", "Backup", Role::kAdmin, CallClass::kAdminLong,
                                   Scope::kServer};
inline constexpr Operation kRestore{"AdminService", "Restore", Role::kAdmin, CallClass::kAdminLong,
                                    Scope::kServer};
inline constexpr Operation kExportCollection{"AdminService", "ExportCollection", Role::kAdmin,
                                             CallClass::kAdminLong, Scope::kCollections};
inline constexpr Operation kImportCollection{"AdminService", "ImportCollection", Role::kAdmin,
                                             CallClass::kAdminLong, Scope::kCollections};
inline constexpr Operation kCheck{"AdminService", "Check", Role::kAdmin, CallClass::kAdminLong,
                                  Scope::kServer};
inline constexpr Operation kStats{"AdminService", "Stats", Role::kAdmin, CallClass::kAdmin, Scope::kServer};
inline constexpr Operation kServerInfo{"AdminService", "ServerInfo", Role::kReader, CallClass::kAdmin,
                                       Scope::kNone};
inline constexpr Operation kCreateKey{"AdminService", "CreateKey", Role::kAdmin, CallClass::kAdmin,
                                      Scope::kKeys};
inline constexpr Operation kListKeys{"AdminService", "ListKeys", Role::kAdmin, CallClass::kAdmin,
                                     Scope::kKeys};
inline constexpr Operation kRevokeKey{"AdminService", "RevokeKey", Role::kAdmin, CallClass::kAdmin,
                                      Scope::kKeys};

/// All of the above. A test compares it with the services in proto/.
inline constexpr std::array<const Operation*, 42> kAll{&kAddShape,
                                                       &kGetShape,
                                                       &kGetShapes,
                                                       &kGetPoints,
                                                       &kGetPreviews,
                                                       &kListShapes,
                                                       &kCountShapes,
                                                       &kCountByValue,
                                                       &kDeleteShape,
                                                       &kDeleteShapes,
                                                       &kUpdateMetadata,
                                                       &kRetryShapes,
                                                       &kWatchIngest,
                                                       &kGetSignature,
                                                       &kGetSegments,
                                                       &kSegment,
                                                       &kSearchByKey,
                                                       &kSearchByScan,
                                                       &kSearchByScanInStages,
                                                       &kSearchBySignature,
                                                       &kSearchBatch,
                                                       &kCompare,
                                                       &kAlign,
                                                       &kCreateCollection,
                                                       &kGetCollection,
                                                       &kListCollections,
                                                       &kDeleteCollection,
                                                       &kRenameCollection,
                                                       &kSetAlias,
                                                       &kDeleteAlias,
                                                       &kRebuild,
                                                       &kCancelRebuild,
                                                       &kBackup,
                                                       &kRestore,
                                                       &kExportCollection,
                                                       &kImportCollection,
                                                       &kCheck,
                                                       &kStats,
                                                       &kServerInfo,
                                                       &kCreateKey,
                                                       &kListKeys,
                                                       &kRevokeKey};

}  // namespace operations

}  // namespace shapedb::security
