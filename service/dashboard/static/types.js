// @ts-check
/**
 * Shapes of the API's answers, as far as the pages use them. A test compares each of them with
 * the OpenAPI document or a real timeline: names of types and properties must be the service's.
 */

/**
 * @typedef {object} CallerOut
 * @property {string} owner
 * @property {"read" | "submit" | "admin"} scope
 * @property {string | null} key_id
 * @property {string | null} key_name
 */

/**
 * @typedef {object} ProgressOut
 * @property {string} phase
 * @property {number} fraction
 * @property {number | null} reward
 * @property {number | null} bound
 * @property {string} message
 */

/**
 * @typedef {object} ScenarioRef
 * @property {string} id
 * @property {string} sha256
 */

/**
 * @typedef {object} ErrorOut
 * @property {string} code
 * @property {string} detail
 */

/**
 * @typedef {object} JobOut
 * @property {string} id
 * @property {string} state
 * @property {ScenarioRef} scenario
 * @property {string} solver
 * @property {Record<string, unknown>} params
 * @property {number} seed
 * @property {number} attempt
 * @property {string | null} label
 * @property {{time_s: number}} limits
 * @property {ProgressOut | null} progress
 * @property {string} created_at
 * @property {string | null} started_at
 * @property {string | null} finished_at
 * @property {string | null} termination
 * @property {ErrorOut | null} error
 * @property {string | null} validity
 * @property {string[]} warnings
 */

/**
 * @typedef {object} HorizonOut
 * @property {string} start
 * @property {string} end
 */

/**
 * @typedef {object} Counts
 * @property {number} satellites
 * @property {number} targets
 * @property {number} ground_stations
 */

/**
 * @typedef {object} ScenarioOut
 * @property {string} id
 * @property {string | null} name
 * @property {HorizonOut} horizon
 * @property {Counts} counts
 * @property {string[]} warnings
 */

/**
 * @typedef {object} SatelliteOut
 * @property {string} id
 * @property {string} name
 * @property {number} norad_cat_id
 * @property {string} epoch
 * @property {string} created_at
 */

/**
 * @typedef {object} GroundStationOut
 * @property {string} id
 * @property {string} name
 * @property {number} lat_deg
 * @property {number} lon_deg
 * @property {number} min_elevation_deg
 */

/**
 * @typedef {object} TargetCatalogOut
 * @property {string} id
 * @property {string} name
 * @property {number} num_targets
 * @property {string} created_at
 */

/**
 * @typedef {object} SolverOut
 * @property {string} name
 * @property {string} title
 * @property {string} description
 * @property {string} paper
 * @property {string} kind
 * @property {string[]} honours
 * @property {Schema} params_schema
 */

/**
 * @typedef {object} ComparedRun
 * @property {string} job_id
 * @property {string} state
 * @property {string} solver
 * @property {ProgressOut | null} progress
 * @property {number | null} reward
 * @property {number | null} bound
 * @property {number | null} gap
 * @property {number | null} collects
 * @property {number | null} contacts
 * @property {number | null} downlinked_mbit
 * @property {number | null} downlinked_fraction
 * @property {number | null} solve_s
 * @property {number | null} runtime_s
 * @property {string | null} validity
 * @property {ErrorOut | null} error
 */

/**
 * @typedef {object} ComparisonOut
 * @property {string} id
 * @property {string} state
 * @property {ScenarioRef} scenario
 * @property {string | null} label
 * @property {string} created_at
 * @property {ComparedRun[]} runs
 */

/**
 * @typedef {object} OpportunityOut
 * @property {string} id
 * @property {string} satellite_id
 * @property {string} kind
 * @property {string | null} target_id
 * @property {string | null} target_name
 * @property {string | null} station_id
 * @property {string | null} station_name
 * @property {string} start
 * @property {string} end
 * @property {number} off_nadir_deg
 * @property {number} elevation_deg
 * @property {number} sun_elevation_deg
 * @property {boolean} eclipse
 */

/**
 * @typedef {object} TargetItem
 * @property {string} target_id
 * @property {string} outcome
 * @property {string | null} action_id
 * @property {string | null} satellite_id
 * @property {Reason | null} reason
 */

/**
 * A reason of `TargetItem`; the fields of `change` depend on its kind.
 * @typedef {object} Reason
 * @property {string} code
 * @property {string} certainty
 * @property {string[]} blocking_actions
 * @property {string | null} opportunity_id
 * @property {string | null} at
 * @property {Record<string, unknown> | null} change
 * @property {string} detail
 */

/**
 * @typedef {object} ExplanationOut
 * @property {string} target_id
 * @property {Record<string, unknown>[]} access_changes
 */

/**
 * @typedef {object} PlannedOut
 * @property {string} satellite_id
 * @property {string | null} satellite_name
 * @property {string | null} target_id
 * @property {string | null} target_name
 * @property {string | null} station_id
 * @property {string | null} station_name
 * @property {string} start
 */

/**
 * @typedef {object} DiffOut
 * @property {PlannedOut[]} added
 * @property {PlannedOut[]} removed
 * @property {{before: PlannedOut, after: PlannedOut}[]} moved
 * @property {Record<string, {before: number | null, after: number | null}>} totals
 */

/**
 * @typedef {object} Slew
 * @property {number} angle_deg
 * @property {number} needed_s
 * @property {number} available_s
 */

/**
 * @typedef {object} Action
 * @property {string} id
 * @property {"collect" | "contact" | "sunpoint" | "hold"} mode
 * @property {string} start
 * @property {string} end
 * @property {string | null} target_id
 * @property {string | null} [target_name] not in answers of earlier releases
 * @property {string | null} station_id
 * @property {string | null} station_name
 * @property {string | null} opportunity_id
 * @property {number | null} off_nadir_deg
 * @property {number | null} azimuth_deg
 * @property {Slew | null} slew
 * @property {number | null} [turn_to_s]
 * @property {number | null} [turn_back_s]
 * @property {number} reward
 * @property {string | null} [delivered_at] not in answers of earlier releases
 * @property {number | null} battery_fraction_end
 * @property {number | null} recorder_fraction_end
 */

/**
 * @typedef {object} ResourceCurves
 * @property {string[]} time
 * @property {number[]} battery_fraction
 * @property {number[]} recorder_fraction
 * @property {number} battery_min_fraction
 * @property {number} recorder_max_fraction
 */

/**
 * @typedef {object} TimelineSatellite
 * @property {string} id
 * @property {string} name
 * @property {Action[]} actions
 * @property {{start: string, end: string}[]} eclipses
 * @property {ResourceCurves | null} resources
 */

/**
 * @typedef {object} Violation
 * @property {string} code
 * @property {string} satellite_id
 * @property {string} at
 * @property {number} needed
 * @property {number} available
 * @property {string[]} actions
 * @property {string} detail
 */

/**
 * @typedef {object} Totals
 * @property {number} reward
 * @property {number | null} bound
 * @property {number | null} gap
 * @property {string | null} bound_proof
 * @property {number} collects
 * @property {number} contacts
 * @property {Record<string, number>} targets
 * @property {number | null} downlinked_mbit
 * @property {number | null} downlinked_fraction
 * @property {number | null} battery_min_fraction
 * @property {number | null} recorder_max_fraction
 */

/**
 * @typedef {object} Timeline
 * @property {string} plan_sha256
 * @property {{start: string, end: string}} horizon
 * @property {string} termination
 * @property {Record<string, number>} runtime_s
 * @property {string} validity
 * @property {Violation[]} violations
 * @property {Totals} totals
 * @property {string[]} warnings
 * @property {TimelineSatellite[]} satellites
 */

/**
 * The part of JSON Schema that the service uses to describe parameters.
 * @typedef {object} Schema
 * @property {string | string[]} [type]
 * @property {unknown[]} [enum]
 * @property {unknown} [default]
 * @property {number} [minimum]
 * @property {number} [exclusiveMinimum]
 * @property {number} [maximum]
 * @property {string} [description]
 * @property {Schema[]} [anyOf]
 * @property {Record<string, Schema>} [properties]
 * @property {string[]} [required]
 */

/**
 * @typedef {object} PlanSatelliteOut
 * @property {string} satellite_id
 * @property {string} satellite_name
 * @property {string | null} in_force_from
 * @property {string | null} in_force_until
 */

/**
 * @typedef {object} PlanOut
 * @property {string} id
 * @property {string | null} name
 * @property {string} state
 * @property {string} job_id
 * @property {string | null} parent_id
 * @property {{start: string, end: string}} horizon
 * @property {string} validity
 * @property {Violation[]} violations
 * @property {PlanSatelliteOut[]} satellites
 * @property {string[]} allowed
 * @property {string} created_at
 */

/**
 * The state of a target across all plans.
 * @typedef {object} TargetLifeOut
 * @property {{id: string, name: string | null, reward: number, due: string | null}} target
 * @property {string} state
 * @property {{plan_id: string, satellite_name: string, start: string} | null} collect
 */

/**
 * @typedef {object} PlanActionOut
 * @property {string} id
 * @property {string} satellite_id
 * @property {string | null} satellite_name
 * @property {string} mode
 * @property {string} start
 * @property {string} end
 * @property {string | null} target_id
 * @property {string | null} target_name
 * @property {string | null} station_id
 * @property {string | null} station_name
 * @property {string | null} outcome
 */

/**
 * @typedef {object} PlanEventOut
 * @property {string} at
 * @property {string} to_state
 * @property {string} owner
 * @property {string | null} key_name
 * @property {string | null} reason
 */

/**
 * @typedef {object} PlanChangeItem
 * @property {string} change
 * @property {PlanActionOut | null} action
 * @property {PlanActionOut | null} parent_action
 * @property {string} cause
 */

/**
 * @typedef {object} PlanChangesOut
 * @property {string | null} freeze_until
 * @property {number} changed_share
 * @property {number} forced_share
 * @property {PlanChangeItem[]} items
 */

/**
 * @typedef {object} PassConflictOut
 * @property {string} satellite_name
 * @property {boolean} planned
 */

/**
 * @typedef {object} PassOut
 * @property {string} station_id
 * @property {string} station_name
 * @property {string} satellite_id
 * @property {string} satellite_name
 * @property {string} aos
 * @property {string} tca
 * @property {string} los
 * @property {number} max_elevation_deg
 * @property {boolean} aos_cut
 * @property {boolean} los_cut
 * @property {boolean} planned
 * @property {number | null} volume_mbit
 * @property {PassConflictOut[]} conflicts
 */

/**
 * @typedef {object} OutageOut
 * @property {string} id
 * @property {string | null} satellite_id
 * @property {string | null} satellite_name
 * @property {string | null} station_id
 * @property {string | null} station_name
 * @property {string} start
 * @property {string} end
 * @property {string | null} reason
 */

/**
 * @typedef {object} ForecastOut
 * @property {string} id
 * @property {string} name
 * @property {string} first
 * @property {string} last
 * @property {number} num_values
 * @property {number | null} num_targets if values are given by target
 * @property {string[]} notes
 */

export {};
