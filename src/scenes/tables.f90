!! Laws that are given by numbers: a force over displacement as a table, for springs and stops, or over velocity, for dampers, or as
!! a polynomial, for springs.
module razy_scenes_tables
   use razy_contact_contact_law, only: contact_law_t
   use razy_contact_jenkins_law, only: new_jenkins_law
   use razy_contact_polynomial_law, only: new_polynomial_law
   use razy_contact_table_law, only: lay_over_rate, new_table_law, table_law_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_real, add_string, group_spec_t, nonnegative, positive
   implicit none(type, external)
   private

   public :: add_damper_keys, add_spring_keys, add_table_keys, check_springs, curved, holds_always, is_linear, new_curved_law, &
             read_stop_table

   integer, parameter :: most_points = 200, most_powers = 9
   character(*), parameter :: of_tables(*) = [character(12) :: "displacement", "force", "line_damping", "beyond"]
   !> Keys of `&spring`, and the laws that they belong to.
   character(*), parameter :: keys(*) = [character(17) :: of_tables, "stiffness", "untuned_stiffness", "coefficients", &
                                                                                                "slip_force"]
   character(*), parameter :: owners(*) = [character(21) :: "'table'", "'table'", "'table'", "'table'", "'linear' or 'jenkins'", &
                                                                                            "'linear'", "'polynomial'", "'jenkins'"]

   !> Keys of `&damper`: its own, and those of its table.
   character(*), parameter :: of_dampers(*) = [character(8) :: "damping", "velocity", "force", "beyond"]
   !> The least stiffness of a Jenkins element, as that of every number that has to be positive.
   real(wp), parameter :: least = 1.0e-30_wp

contains

   !> Add the keys of a table to the last group.
   subroutine add_table_keys(schema, of)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: of

      call add_real(schema, "displacement", of//" at the points of the table of law='table', rising", unit="m or rad", least=2, &
                    most=most_points)
      call add_force_keys(schema)
      call add_real(schema, "line_damping", "damping of each line between two points; one value for all; 0 if not given", &
                    unit="N s/m or N m s/rad", rule=nonnegative, least=1, most=most_points - 1)
   end subroutine add_table_keys

   !> Add the keys of a table to `&damper`.
   subroutine add_damper_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_real(schema, "velocity", "s' at the points of a table, rising, in the place of damping", unit="m/s or rad/s", &
                    least=2, most=most_points)
      call add_force_keys(schema)
   end subroutine add_damper_keys

   subroutine add_force_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_real(schema, "force", "force at each of them; between them it is linear", unit="N or N m", least=2, most=most_points)
      call add_string(schema, "beyond", "beyond the ends of the table its last lines go on, or the motion ends with a status; "// &
                      "'continue' if not given", choices=["continue", "refuse  "])
   end subroutine add_force_keys

   !> Add the keys of the law to `&spring`.
   subroutine add_spring_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "law", "force of the spring", choices=[character(10) :: "linear", "table", "polynomial", "jenkins"], &
                      default="linear")
      call add_table_keys(schema, "q1 - q2")
      call add_real(schema, "coefficients", "c1, c2, c3, ... of the force c1 s + c2 s^2 + c3 s^3 + ... of law='polynomial'", &
                    unit="N/m^n or N m/rad^n", least=1, most=most_powers)
      call add_real(schema, "slip_force", "force at which the slider of law='jenkins', in series with the stiffness, gives way", &
                    unit="N or N m", rule=positive)
   end subroutine add_spring_keys

   !> Whether number i of `group` is linear, and so, if a spring or damper, belongs to a matrix.
   logical function is_linear(input, group, i)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i

      is_linear = .true.
      if (group == "spring") is_linear = input%choice(group, i, "law") == "linear"
      if (group == "damper") is_linear = .not. input%given(group, i, "velocity")
   end function is_linear

   !> Whether `&spring` number i holds whatever its stretch is: that of a table may have lines without stiffness.
   logical function holds_always(input, i)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i

      holds_always = input%choice("spring", i, "law") == "polynomial"
   end function holds_always

   !> The numbers of the springs or dampers, as `group` says, that are not linear, and so are contacts without a gap.
   function curved(input, group) result(number)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, allocatable :: number(:)

      integer :: i

      number = pack([(i, i=1, input%count(group))], [(.not. is_linear(input, group, i), i=1, input%count(group))])
   end function curved

   !> Refuse keys of another law, and a spring or damper without what its own needs.
   subroutine check_springs(input, error)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: law
      logical :: given(size(of_dampers))
      real(wp) :: damping, factor
      integer :: i, k

      do i = 1, input%count("spring")
         law = input%choice("spring", i, "law")
         k = findloc([(input%given("spring", i, trim(keys(k))) .and. index(owners(k), "'"//law//"'") == 0, k=1, size(keys))], &
                     .true., dim=1)
         if (k > 0) call input%complain(error, "spring", i, trim(keys(k)), "left out with law = '"//law// &
                                        "'; it belongs to "//trim(owners(k)))
         if (allocated(error)) return
         ! Keys that not every kind of scene has.
         factor = input%number("spring", i, "damping_factor", otherwise=0.0_wp)
         damping = input%number("spring", i, "damping")
         if (law /= "linear" .and. abs(factor) > 0.0_wp) then
            call input%complain(error, "spring", i, "damping_factor", "0 with law = '"//law//"'; it belongs to 'linear'")
         else if (law == "table" .and. abs(damping) > 0.0_wp) then
            call input%complain(error, "spring", i, "damping", "0 with law = 'table', which has line_damping")
         else if (any(law == ["linear ", "jenkins"]) .and. .not. input%given("spring", i, "stiffness")) then
            call input%complain(error, "spring", i, "stiffness", "required: the stiffness in N/m or N m/rad")
         else if (law == "polynomial" .and. .not. input%given("spring", i, "coefficients")) then
            call input%complain(error, "spring", i, "coefficients", "required by law = 'polynomial': c1, c2, c3, ...")
         else if (law == "jenkins" .and. .not. input%given("spring", i, "slip_force")) then
            call input%complain(error, "spring", i, "slip_force", "required by law = 'jenkins': the force at which it slides")
         end if
         if (allocated(error)) return
      end do
      do i = 1, input%count("damper")
         given = [(input%given("damper", i, trim(of_dampers(k))), k=1, size(of_dampers))]
         if (all(given(:2))) then
            call input%complain(error, "damper", i, "damping", "left out beside a table of velocity and force")
         else if (.not. any(given(:2))) then
            call input%complain(error, "damper", i, "damping", "required: viscous damping in N s/m or N m s/rad, or a table of "// &
                                "velocity and force")
         else if (given(1) .and. any(given(3:))) then
            call input%complain(error, "damper", i, "velocity", "required: a value for each point of the table")
         end if
         if (allocated(error)) return
      end do
   end subroutine check_springs

   !> The law of number i of `group`, a spring or damper that is not linear.
   subroutine new_curved_law(law, input, group, i, error)
      class(contact_law_t), allocatable, intent(out) :: law
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(table_law_t) :: table
      character(:), allocatable :: kind
      real(wp), allocatable :: damping(:), force(:), place(:)
      real(wp) :: stiffness

      kind = "table"
      if (group == "spring") kind = input%choice("spring", i, "law")
      select case (kind)
      case ("jenkins")
         stiffness = input%number("spring", i, "stiffness")
         if (.not. stiffness >= least) call input%complain(error, "spring", i, "stiffness", "positive with law = 'jenkins'")
         if (allocated(error)) return
         law = new_jenkins_law(stiffness, input%number("spring", i, "slip_force"), input%number("spring", i, "damping"))
      case ("polynomial")
         law = new_polynomial_law(input%list("spring", i, "coefficients"), input%number("spring", i, "damping"))
      case default
         call read_table(input, group, i, trim(merge("velocity    ", "displacement", group == "damper")), place, force, damping, &
                         error)
         if (allocated(error)) return
         table = new_table_law(place, force, damping, 0.0_wp, .false., spread(input%choice(group, i, "beyond") == "refuse", 1, 2))
         if (group == "damper") call lay_over_rate(table)
         law = table
      end select
   end subroutine new_curved_law

   !> The law of a stop over its deformation, on the `sides` that close at `edges`.
   subroutine read_stop_table(law, input, group, i, sides, edges, error)
      class(contact_law_t), allocatable, intent(out) :: law
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      logical, intent(in) :: sides(2)
      real(wp), intent(in) :: edges(2)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: damping(:), force(:), place(:), at(:), pushes(:), of_line(:)
      real(wp) :: ends(2), gap
      integer :: first, n, reach(2)

      call read_table(input, group, i, "displacement", place, force, damping, error)
      if (allocated(error)) return
      n = size(place)
      if (abs(place(1)) > 0.0_wp .or. abs(force(1)) > 0.0_wp) then
         call input%complain(error, group, i, trim(merge("displacement", "force       ", abs(place(1)) > 0.0_wp)), &
                             "0 at the first point, where a stop touches")
      else if (any(force < 0.0_wp)) then
         call input%complain(error, group, i, "force", "none below 0: a stop does not pull")
      end if
      if (allocated(error)) return
      gap = 1.0_wp
      if (all(sides)) gap = edges(2) - edges(1)
      ! Of a side that is not there one point, to which the open line leads, as from any other place.
      ends = merge(edges, [edges(2) - gap, edges(1) + gap], sides)
      reach = merge(n, 1, sides)
      ! Sides without a gap share the point where they touch.
      first = merge(1, 2, gap > 0.0_wp)
      at = [ends(1) - place(reach(1):1:-1), ends(2) + place(first:reach(2))]
      pushes = [-force(reach(1):1:-1), force(first:reach(2))]
      of_line = [damping(reach(1) - 1:1:-1), spread(0.0_wp, 1, 2 - first), damping(:reach(2) - 1)]
      law = new_table_law(at, pushes, of_line, merge(edges(1), edges(2), sides(1)) + merge(0.5_wp, -0.5_wp, sides(1))*gap, &
                          gap > 0.0_wp, merge(sides, .false., input%choice(group, i, "beyond") == "refuse"))
   end subroutine read_stop_table

   !> The points of a table (n), whose places are the key `over`, and the damping of its lines (n - 1).
   subroutine read_table(input, group, i, over, place, force, damping, error)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, over
      integer, intent(in) :: i
      real(wp), allocatable, intent(out) :: place(:), force(:), damping(:)
      type(error_t), allocatable, intent(out) :: error

      integer :: k

      k = findloc([input%given(group, i, over), input%given(group, i, "force")], .false., dim=1)
      if (k > 0) call input%complain(error, group, i, trim(of_tables(k)), "required: a value for each point of the table")
      if (allocated(error)) return
      call input%get(group, i, over, place)
      call input%get(group, i, "force", force)
      associate (n => size(place))
         damping = [(0.0_wp, k=1, n - 1)]
         if (input%given(group, i, "line_damping")) call input%get(group, i, "line_damping", damping)
         if (size(damping) == 1) damping = [(damping(1), k=1, n - 1)]
         if (.not. all(place(2:) > place(:n - 1))) then
            call input%complain(error, group, i, over, "values that rise from point to point")
         else if (size(force) /= n) then
            call input%complain(error, group, i, "force", to_text(n)//" values, one for each "//over)
         else if (size(damping) /= n - 1) then
            call input%complain(error, group, i, "line_damping", "one value, or "//to_text(n - 1)//", one for each line")
         end if
      end associate
   end subroutine read_table

end module razy_scenes_tables
