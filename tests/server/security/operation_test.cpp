// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/operation.h"

#include <map>
#include <set>
#include <string>

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "shapedb/v1/admin_service.pb.h"
#include "shapedb/v1/align_service.pb.h"
#include "shapedb/v1/collection_service.pb.h"
#include "shapedb/v1/search_service.pb.h"
#include "shapedb/v1/shape_service.pb.h"

namespace shapedb::security {
namespace {

using google::protobuf::FileDescriptor;

const std::vector<const FileDescriptor*>& files() {
    static const std::vector<const FileDescriptor*> all = {
        v1::GetShapeRequest::descriptor()->file(), v1::CompareRequest::descriptor()->file(),
        v1::AlignRequest::descriptor()->file(), v1::GetCollectionRequest::descriptor()->file(),
        v1::StatsRequest::descriptor()->file()};
    return all;
}

TEST(Operations, AreThoseOfTheServices) {
    std::set<std::string> declared;
    for (const Operation* operation : operations::kAll) {
        EXPECT_TRUE(declared.insert(std::string(operation->service) + "/" + operation->name).second)
            << operation->name << " stands twice";
    }
    std::set<std::string> defined;
    for (const FileDescriptor* file : files()) {
        for (int s = 0; s < file->service_count(); ++s) {
            for (int m = 0; m < file->service(s)->method_count(); ++m) {
                defined.insert(file->service(s)->name() + "/" + file->service(s)->method(m)->name());
            }
        }
    }
    EXPECT_EQ(declared, defined) << "every rpc declares its role in server/security/operation.h";
}

TEST(Operations, WhatLastsAsLongAsTheClientSendsIsAnUpload) {
    std::map<std::string, const Operation*> byName;
    for (const Operation* operation : operations::kAll) byName[operation->name] = operation;
    for (const FileDescriptor* file : files()) {
        for (int s = 0; s < file->service_count(); ++s) {
            for (int m = 0; m < file->service(s)->method_count(); ++m) {
                const auto* method = file->service(s)->method(m);
                const CallClass kind = byName.at(method->name())->callClass;
                if (method->client_streaming()) {
                    EXPECT_NE(kind, CallClass::kOrdinary) << method->name();
                } else {
                    EXPECT_NE(kind, CallClass::kUpload) << method->name();
                }
            }
        }
    }
}

TEST(Operations, StreamsOfAdministratorsLeavePlacesForTheirOtherCalls) {
    const auto* service = files().front()->pool()->FindServiceByName("shapedb.v1.AdminService");
    ASSERT_NE(service, nullptr);
    for (const Operation* operation : operations::kAll) {
        if (operation->service != std::string("AdminService")) continue;
        const auto* method = service->FindMethodByName(operation->name);
        ASSERT_NE(method, nullptr) << operation->name;
        const bool streams = method->client_streaming() || method->server_streaming();
        EXPECT_EQ(operation->callClass, streams ? CallClass::kAdminLong : CallClass::kAdmin)
            << operation->name;
    }
}

TEST(Operations, DestructiveOnesAreForAdministrators) {
    for (const Operation* operation :
         {&operations::kRestore, &operations::kDeleteCollection, &operations::kCreateCollection,
          &operations::kBackup, &operations::kRebuild}) {
        EXPECT_EQ(operation->role, Role::kAdmin) << operation->name;
    }
}

}  // namespace
}  // namespace shapedb::security
