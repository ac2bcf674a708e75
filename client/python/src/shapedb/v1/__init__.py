# SPDX-License-Identifier: Apache-2.0
"""The messages and stubs of the API, made by protoc. Not part of the public interface."""
