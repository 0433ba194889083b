/* Prints where every field of the structs lies, one line each: other languages compare theirs. */
#include <frazil.h>
#include <stdio.h>

#define SIZE(type) printf("%s %zu\n", #type, sizeof(type))
#define FIELD(type, field) printf("%s.%s %zu\n", #type, #field, offsetof(type, field))

int main(void) {
    SIZE(frz_view), FIELD(frz_view, data), FIELD(frz_view, count), FIELD(frz_view, stride);
    SIZE(frz_span), FIELD(frz_span, data), FIELD(frz_span, count), FIELD(frz_span, stride);
    SIZE(frz_progress), FIELD(frz_progress, stage), FIELD(frz_progress, stages_done), FIELD(frz_progress, seconds);
    FIELD(frz_progress, fraction);
    SIZE(frz_stage_time), FIELD(frz_stage_time, stage), FIELD(frz_stage_time, seconds);
    SIZE(frz_attribute), FIELD(frz_attribute, name), FIELD(frz_attribute, components), FIELD(frz_attribute, values);
    SIZE(frz_mesh_desc), FIELD(frz_mesh_desc, struct_size), FIELD(frz_mesh_desc, flags);
    FIELD(frz_mesh_desc, positions), FIELD(frz_mesh_desc, face_counts), FIELD(frz_mesh_desc, indices);
    FIELD(frz_mesh_desc, attributes), FIELD(frz_mesh_desc, attribute_count);
    SIZE(frz_mesh_info), FIELD(frz_mesh_info, struct_size), FIELD(frz_mesh_info, closed);
    FIELD(frz_mesh_info, vertex_count), FIELD(frz_mesh_info, face_count), FIELD(frz_mesh_info, corner_count);
    FIELD(frz_mesh_info, triangle_count), FIELD(frz_mesh_info, attribute_count), FIELD(frz_mesh_info, box_min);
    FIELD(frz_mesh_info, box_max), FIELD(frz_mesh_info, area), FIELD(frz_mesh_info, volume);
    SIZE(frz_leaf), FIELD(frz_leaf, origin), FIELD(frz_leaf, tile), FIELD(frz_leaf, values), FIELD(frz_leaf, mask);
    SIZE(frz_vector_leaf), FIELD(frz_vector_leaf, origin), FIELD(frz_vector_leaf, tile);
    FIELD(frz_vector_leaf, values), FIELD(frz_vector_leaf, mask);
    SIZE(frz_grid_desc), FIELD(frz_grid_desc, struct_size), FIELD(frz_grid_desc, grid_class);
    FIELD(frz_grid_desc, voxel_size), FIELD(frz_grid_desc, background), FIELD(frz_grid_desc, flags);
    FIELD(frz_grid_desc, leaves), FIELD(frz_grid_desc, leaf_count), FIELD(frz_grid_desc, name);
    FIELD(frz_grid_desc, value_type), FIELD(frz_grid_desc, background_vector), FIELD(frz_grid_desc, vector_leaves);
    SIZE(frz_grid_info), FIELD(frz_grid_info, struct_size), FIELD(frz_grid_info, grid_class);
    FIELD(frz_grid_info, voxel_size), FIELD(frz_grid_info, background), FIELD(frz_grid_info, world_fixed);
    FIELD(frz_grid_info, active_voxels), FIELD(frz_grid_info, leaf_count), FIELD(frz_grid_info, memory_bytes);
    FIELD(frz_grid_info, voxel_min), FIELD(frz_grid_info, voxel_max), FIELD(frz_grid_info, value_type);
    FIELD(frz_grid_info, background_vector);
    SIZE(frz_noise), FIELD(frz_noise, amplitude), FIELD(frz_noise, size), FIELD(frz_noise, octaves);
    FIELD(frz_noise, seed);
    SIZE(frz_body), FIELD(frz_body, struct_size), FIELD(frz_body, flags), FIELD(frz_body, id);
    FIELD(frz_body, positions), FIELD(frz_body, positions_end), FIELD(frz_body, between);
    FIELD(frz_body, between_count), FIELD(frz_body, face_counts), FIELD(frz_body, indices);
    FIELD(frz_body, friction);
    SIZE(frz_snow_desc), FIELD(frz_snow_desc, struct_size), FIELD(frz_snow_desc, flags);
    FIELD(frz_snow_desc, voxel_size), FIELD(frz_snow_desc, half_width), FIELD(frz_snow_desc, depth);
    FIELD(frz_snow_desc, top), FIELD(frz_snow_desc, ground), FIELD(frz_snow_desc, ground_height);
    FIELD(frz_snow_desc, area), FIELD(frz_snow_desc, statics), FIELD(frz_snow_desc, static_count);
    SIZE(frz_base_params), FIELD(frz_base_params, struct_size), FIELD(frz_base_params, flags);
    FIELD(frz_base_params, tolerance), FIELD(frz_base_params, noise);
    SIZE(frz_base_report), FIELD(frz_base_report, struct_size), FIELD(frz_base_report, reserved);
    FIELD(frz_base_report, removed_volume), FIELD(frz_base_report, base_volume);
    FIELD(frz_base_report, touched_blocks), FIELD(frz_base_report, sweep_faces);
    SIZE(frz_grains_params), FIELD(frz_grains_params, struct_size), FIELD(frz_grains_params, flags);
    FIELD(frz_grains_params, radius), FIELD(frz_grains_params, compression), FIELD(frz_grains_params, friction);
    FIELD(frz_grains_params, attraction), FIELD(frz_grains_params, air), FIELD(frz_grains_params, gravity);
    FIELD(frz_grains_params, floor), FIELD(frz_grains_params, lowest), FIELD(frz_grains_params, max_grains);
    FIELD(frz_grains_params, seed), FIELD(frz_grains_params, sub_steps), FIELD(frz_grains_params, reserved);
    FIELD(frz_grains_params, active_distance);
    SIZE(frz_grains_report), FIELD(frz_grains_report, struct_size), FIELD(frz_grains_report, sub_steps);
    FIELD(frz_grains_report, count), FIELD(frz_grains_report, resting), FIELD(frz_grains_report, born), FIELD(frz_grains_report, dropped);
    FIELD(frz_grains_report, removed_volume), FIELD(frz_grains_report, owed), FIELD(frz_grains_report, fastest);
    SIZE(frz_particles), FIELD(frz_particles, struct_size), FIELD(frz_particles, flags), FIELD(frz_particles, positions);
    FIELD(frz_particles, velocities), FIELD(frz_particles, ids);
    SIZE(frz_tracker_params), FIELD(frz_tracker_params, struct_size), FIELD(frz_tracker_params, flags);
    FIELD(frz_tracker_params, spacing), FIELD(frz_tracker_params, cell), FIELD(frz_tracker_params, change);
    FIELD(frz_tracker_params, half_life), FIELD(frz_tracker_params, fade);
    FIELD(frz_tracker_params, weighting), FIELD(frz_tracker_params, reserved);
    FIELD(frz_tracker_params, rebuild), FIELD(frz_tracker_params, match), FIELD(frz_tracker_params, min_drop);
    FIELD(frz_tracker_params, reserved3);
    SIZE(frz_tracker_report), FIELD(frz_tracker_report, struct_size), FIELD(frz_tracker_report, parts);
    FIELD(frz_tracker_report, jumped), FIELD(frz_tracker_report, lost), FIELD(frz_tracker_report, born);
    FIELD(frz_tracker_report, died), FIELD(frz_tracker_report, triangles);
    FIELD(frz_tracker_report, drops), FIELD(frz_tracker_report, bubbles), FIELD(frz_tracker_report, uncovered);
    FIELD(frz_tracker_report, changed), FIELD(frz_tracker_report, rung), FIELD(frz_tracker_report, changed_cells);
    FIELD(frz_tracker_report, rebuilt_cells), FIELD(frz_tracker_report, made_triangles);
    FIELD(frz_tracker_report, specks);
    SIZE(frz_repair_report), FIELD(frz_repair_report, struct_size), FIELD(frz_repair_report, rung);
    FIELD(frz_repair_report, joined_vertices), FIELD(frz_repair_report, dropped_triangles);
    FIELD(frz_repair_report, turned_triangles), FIELD(frz_repair_report, turned_parts), FIELD(frz_repair_report, holes);
    FIELD(frz_repair_report, added_triangles), FIELD(frz_repair_report, flagged_cells);
    FIELD(frz_repair_report, rebuilt_cells), FIELD(frz_repair_report, kept_triangles);
    FIELD(frz_repair_report, slivers), FIELD(frz_repair_report, cell);
    return 0;
}
