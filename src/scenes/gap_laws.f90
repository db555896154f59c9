!! The laws of a contact with a gap as an input names them, for every scene that has such contacts: their keys, what each law
!! needs, and the law that they make.
module razy_scenes_gap_laws
   use razy_contact_clearance_law, only: clearance_side_t, new_clearance_law
   use razy_contact_contact_law, only: contact_law_t
   use razy_contact_power_law, only: hertz_stiffness, new_power_law, power_side_t
   use razy_contact_rigid_law, only: new_rigid_law, rigid_side_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_real, add_string, group_spec_t, nonnegative, positive
   use razy_scenes_tables, only: add_table_keys, read_stop_table
   implicit none(type, external)
   private

   public :: add_gap_law_keys, read_gap_law

   character(*), parameter :: laws(*) = [character(15) :: "kelvin_voigt", "hunt_crossley", "hertz", "rigid", &
                                                                                                "switched_spring", "table"]
   !> All keys that some law has and some law has not.
   character(*), parameter :: keys(*) = [character(13) :: "displacement", "force", "line_damping", "beyond", &
                                                                   "stiffness", "damping", "separation", "exponent", "hysteresis", &
                                                                          "restitution", "radius", "young_modulus", "poisson_ratio"]
   !> A surface that is not curved.
   real(wp), parameter :: flat = huge(1.0_wp)

contains

   !> Add the keys of the law to the last group.
   subroutine add_gap_law_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "law", "law of the closed contact", choices=laws, default="kelvin_voigt")
      call add_real(schema, "stiffness", "stiffness of the closed contact, with n = 1.5 for 'hertz', n = exponent for "// &
                    "'hunt_crossley', else n = 1; not for 'rigid'", unit="N/m^n or N m/rad^n", rule=positive)
      call add_real(schema, "damping", "damping of the closed contact, for 'kelvin_voigt' and 'switched_spring'; 0 if not given", &
                    unit="N s/m or N m s/rad", low=0.0_wp, high=1.0e15_wp)
      call add_string(schema, "separation", "where a damped contact is lost; 'zero_force' if not given", &
                      choices=["zero_deformation", "zero_force      "])
      call add_real(schema, "exponent", "exponent n of the deformation, for 'hunt_crossley'; 1.5 if not given", low=1.0_wp, &
                    high=10.0_wp)
      call add_real(schema, "hysteresis", "factor alpha of the damping, for 'hunt_crossley'", unit="s/m or s/rad", rule=nonnegative)
      call add_real(schema, "restitution", "coefficient of restitution, for 'rigid'", low=0.0_wp, high=1.0_wp)
      call add_real(schema, "radius", "radii of the two surfaces, for 'hertz'; of one only: the other is flat", unit="m", &
                    rule=positive, least=1, most=2)
      call add_real(schema, "young_modulus", "of the two bodies, for 'hertz'; one value for both", unit="Pa", rule=positive, &
                    least=1, most=2)
      call add_real(schema, "poisson_ratio", "of the two bodies, for 'hertz'; one value for both", low=0.0_wp, high=0.5_wp, &
                    least=1, most=2)
      call add_table_keys(schema, "deformation of the contact")
   end subroutine add_gap_law_keys

   !> The law of `group` number i, whose lower and upper side are `sides` and close at `edges`. `turns`: s is an angle.
   !> `damping_factor`, s: damping in proportion to the stiffness, only for 'kelvin_voigt'.
   subroutine read_gap_law(law, input, group, i, sides, edges, turns, damping_factor, error)
      class(contact_law_t), allocatable, intent(out) :: law
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      logical, intent(in) :: sides(2), turns
      real(wp), intent(in) :: edges(2), damping_factor
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: kind
      real(wp), allocatable :: modulus(:), radius(:), ratio(:)
      real(wp) :: damping, exponent, hysteresis, stiffness
      logical :: by_force

      kind = input%choice(group, i, "law")
      call check_keys(input, group, i, kind, error)
      if (allocated(error)) return
      stiffness = input%number(group, i, "stiffness", otherwise=0.0_wp)
      damping = input%number(group, i, "damping", otherwise=0.0_wp)
      exponent = input%number(group, i, "exponent", otherwise=1.5_wp)
      hysteresis = input%number(group, i, "hysteresis", otherwise=0.0_wp)
      if (damping_factor > 0.0_wp .and. kind /= "kelvin_voigt") then
         call input%complain(error, group, i, "damping_factor", "only with law = 'kelvin_voigt'")
         return
      end if
      if (kind == "table") then
         call read_stop_table(law, input, group, i, sides, edges, error)
         return
      end if
      damping = damping + damping_factor*stiffness
      if (kind == "hertz" .and. input%given(group, i, "radius")) then
         if (turns) then
            call input%complain(error, group, i, "radius", "for masses only; between inertias give the stiffness in N m/rad^1.5")
            return
         end if
         call input%get(group, i, "young_modulus", modulus)
         call input%get(group, i, "poisson_ratio", ratio)
         radius = [input%list(group, i, "radius"), flat]
         stiffness = hertz_stiffness(radius(1), radius(2), modulus(1), ratio(1), modulus(size(modulus)), ratio(size(ratio)))
      end if
      ! Surfaces do not pull; only the spring that is switched does, as its source has it.
      by_force = input%choice(group, i, "separation") == "zero_force" .or. &
                 (.not. input%given(group, i, "separation") .and. max(damping, hysteresis) > 0.0_wp .and. kind /= "switched_spring")
      select case (kind)
      case ("hunt_crossley", "hertz")
         law = new_power_law(power_side_t(sides(1), edges(1), stiffness, exponent, hysteresis), &
                             power_side_t(sides(2), edges(2), stiffness, exponent, hysteresis), by_force)
      case ("rigid")
         law = new_rigid_law(rigid_side_t(sides(1), edges(1)), rigid_side_t(sides(2), edges(2)), &
                             input%number(group, i, "restitution"))
      case ("switched_spring")
         ! Closed it pulls back to s = 0, so at touch it is already stretched by the edge.
         if (any(sides .and. edges*[-1.0_wp, 1.0_wp] < 0.0_wp)) then
            call input%complain(error, group, i, "clearance", "at least 0 for law = 'switched_spring'")
            return
         end if
         law = new_clearance_law(clearance_side_t(sides(1), edges(1), stiffness, damping, -stiffness*edges(1)), &
                                 clearance_side_t(sides(2), edges(2), stiffness, damping, stiffness*edges(2)), &
                                 by_force)
      case default
         law = new_clearance_law(clearance_side_t(sides(1), edges(1), stiffness, damping), &
                                 clearance_side_t(sides(2), edges(2), stiffness, damping), by_force)
      end select
   end subroutine read_gap_law

   !> Refuse keys of other laws, and a law without what it needs.
   subroutine check_keys(input, group, i, kind, error)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, kind
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      integer :: k

      do k = 1, size(keys)
         if (.not. input%given(group, i, trim(keys(k)))) cycle
         if (index(" "//taken_by(kind)//",", " "//trim(keys(k))//",") > 0) cycle
         call input%complain(error, group, i, trim(keys(k)), "belongs to another law; law = '"//kind//"' takes "//taken_by(kind))
         return
      end do
      select case (kind)
      case ("hertz")
         call check_hertz(input, group, i, error)
      case ("table")
         call need("displacement", "a deformation for each point, the first 0")
      case ("rigid")
         call need("restitution", "the coefficient of restitution, from 0 to 1")
      case ("hunt_crossley")
         call need("stiffness", "the stiffness in N/m^n or N m/rad^n")
         if (.not. allocated(error)) call need("hysteresis", "alpha in s/m or s/rad")
      case default
         call need("stiffness", "the stiffness in N/m or N m/rad")
      end select

   contains

      subroutine need(key, what)
         character(*), intent(in) :: key, what

         if (.not. input%given(group, i, key)) call input%complain(error, group, i, key, "required by law = '"//kind//"': "//what)
      end subroutine need

   end subroutine check_keys

   !> The keys that a law may have.
   pure function taken_by(kind) result(list)
      character(*), intent(in) :: kind
      character(:), allocatable :: list

      select case (kind)
      case ("hunt_crossley")
         list = "stiffness, hysteresis, exponent, separation"
      case ("hertz")
         list = "stiffness, or radius, young_modulus, poisson_ratio"
      case ("rigid")
         list = "restitution"
      case ("table")
         list = "displacement, force, line_damping, beyond"
      case default
         list = "stiffness, damping, separation"
      end select
   end function taken_by

   !> Either the stiffness, or all of what it follows from.
   subroutine check_hertz(input, group, i, error)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: both = "either the stiffness, or radius, young_modulus and poisson_ratio"
      character(*), parameter :: from(3) = [character(13) :: "radius", "young_modulus", "poisson_ratio"]
      logical :: given(3)
      integer :: k

      given = [(input%given(group, i, trim(from(k))), k=1, 3)]
      if (input%given(group, i, "stiffness") .eqv. any(given)) then
         call input%complain(error, group, i, "stiffness", "required by law = 'hertz': "//both)
      else if (any(given) .and. .not. all(given)) then
         call input%complain(error, group, i, trim(from(findloc(given, .false., dim=1))), "required by law = 'hertz': "//both)
      end if
   end subroutine check_hertz

end module razy_scenes_gap_laws
