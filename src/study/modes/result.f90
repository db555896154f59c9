!! What razy-modes finds: natural frequencies and shapes, for rotors eigenvalues over the speed, reduced models beside the unreduced
!! one; as a table and in words.
module razy_study_modes_result
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_core_verdict, only: is_neutral, is_undecided, verdict_words, verdicts
   use razy_rotor_whirl_critical, only: critical_t
   use razy_study_modes_response, only: parts_of, response_t
   implicit none(type, external)
   private

   public :: modes_result_t, reduction_result_t

   !> The comparison of several kinds of reduction; NaN where a model has no such number.
   type :: reduction_result_t
      !> What each kind is called, and its number of coordinates (kinds).
      character(64), allocatable :: name(:)
      integer, allocatable :: coordinates(:)
      !> Static compliance of each mesh, m/N (meshes, kinds), and of the unreduced model (meshes).
      real(wp), allocatable :: compliance(:, :), true_compliance(:)
      !> Natural frequencies of the unreduced model with meshes closed, Hz (modes); whether these modes move a mesh (1 or 0); the
      !> nearest frequency that each kind has (modes, kinds).
      real(wp), allocatable :: frequency(:, :), true_frequency(:)
      integer, allocatable :: moves(:)
      !> Frequencies, Hz; the transfer function at each mesh (frequencies, meshes, kinds), m/N, and of the unreduced model.
      real(wp), allocatable :: hertz(:)
      complex(wp), allocatable :: response(:, :, :), true_response(:, :)
      !> Largest errors (3, kinds) of compliance and frequency, relative, and of the transfer function over its largest modulus.
      real(wp), allocatable :: error(:, :)
   end type reduction_result_t

   !> The results; what is not allocated is not written.
   type :: modes_result_t
      !> Names of the coordinates (coordinates), undamped shapes at rest (coordinates, modes), their frequencies, Hz (modes).
      character(64), allocatable :: coordinate(:)
      real(wp), allocatable :: shape(:, :), natural(:)
      !> Whether a mode is a rigid motion that nothing holds (1 or 0), and what these are, in words.
      integer, allocatable :: rigid(:)
      character(:), allocatable :: free
      !> Parts and their shares of the kinetic energy (parts, modes), of the strain energy likewise.
      character(64), allocatable :: part(:), strain_part(:)
      real(wp), allocatable :: share(:, :), strain_share(:, :)
      !> Names of shafts and their shares of the kinetic energy (shafts, modes).
      character(64), allocatable :: shaft(:)
      real(wp), allocatable :: shaft_share(:, :)
      !> Reduced models beside the unreduced one.
      type(reduction_result_t), allocatable :: reduction
      !> Names of gear meshes and their deformation in the shapes (meshes, modes).
      character(64), allocatable :: mesh(:)
      real(wp), allocatable :: deformation(:, :)
      !> Speeds, rad/s; frequencies, Hz (modes, speeds).
      real(wp), allocatable :: speed(:), frequency(:, :)
      !> Eigenvalues (eigenvalues, speeds), 1/s. As many as modes with `branch`.
      complex(wp), allocatable :: eigenvalue(:, :)
      !> What each says of stability, verdicts of razy_core_verdict.
      integer, allocatable :: verdict(:, :)
      !> Number of the branch, direction of whirl (modes, speeds).
      real(wp), allocatable :: branch(:, :), direction(:, :)
      !> Critical speeds (criticals).
      type(critical_t), allocatable :: critical(:)
      !> Crossings that were seen but not located.
      integer :: lost = 0
      !> The stability limit and the first speed below it that is undecided, rad/s, the frequency of the motion that grows above
      !> the limit or above that after instability at the first speed, Hz, NaN if there is none; what it is, what
      !> follows on instability at the first speed, and what it is a statement about, in words.
      real(wp), allocatable :: limit, limit_frequency, undecided
      character(:), allocatable :: limit_check, limit_then, limit_words
      !> The response to harmonic loads.
      type(response_t), allocatable :: response
   contains
      procedure :: columns
      procedure :: words
   end type modes_result_t

   character(*), parameter :: mode = "/mode", speed = "/speed"
   !> More of a kind than this are counted, not listed.
   integer, parameter :: most_lines = 20
   !> Shares below this are not named; nor is whirl.
   real(wp), parameter :: named = 0.1_wp
   !> Directions of whirl above this are called forward, below its negative backward.
   real(wp), parameter :: round = 0.5_wp

contains

   !> Hand over what was found.
   subroutine columns(self, table)
      class(modes_result_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: coordinate = "/coordinate", part = "/part", strain_part = "/strain_part", mesh = "/mesh", &
                                 shaft = "/shaft"
      integer :: i

      call table%add(mode, [(i, i=1, size(self%natural))], "1", "number of the mode", mode)
      call table%add(coordinate, self%coordinate, "1", "name of the coordinate", coordinate)
      call table%add("/natural_frequency", self%natural, "Hz", "undamped natural frequency at rest", mode)
      if (allocated(self%rigid)) then
         call table%add("/rigid", self%rigid, "1", "1 for a rigid motion that nothing holds", mode)
         call table%note("motions", self%free)
      end if
      call table%add("/shape", self%shape, "1", "undamped mode at rest, mass-normalised", [character(11) :: coordinate, mode])
      call table%add(part, self%part, "1", "what a share belongs to", part)
      call table%add("/energy_share", self%share, "1", "share of the kinetic energy of an undamped mode at rest", [part, mode])
      if (allocated(self%strain_share)) then
         call table%add(strain_part, self%strain_part, "1", "what a share of strain energy belongs to", strain_part)
         call table%add("/strain_share", self%strain_share, "1", "share of the strain energy of an undamped mode at rest", &
                        [character(12) :: strain_part, mode])
         call table%add(mesh, self%mesh, "1", "name of the gear mesh", mesh)
         call table%add("/mesh_deformation", self%deformation, "1", "deformation of a mesh in an undamped mode at rest", &
                        [mesh, mode])
         call table%add(shaft, self%shaft, "1", "name of the shaft", shaft)
         call table%add("/shaft_share", self%shaft_share, "1", &
                        "share of a shaft in the kinetic energy of an undamped mode at rest", [character(6) :: shaft, mode])
      end if
      call speed_columns(self, table)
      if (allocated(self%reduction)) call reduction_columns(self%reduction, table)
      if (allocated(self%critical)) call critical_columns(self, table)
      if (allocated(self%response)) call self%response%columns(table)
   end subroutine columns

   !> What depends on the speed.
   subroutine speed_columns(self, table)
      class(modes_result_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: along(2) = [character(6) :: mode, speed]
      character(6) :: roots(2)
      real(wp), allocatable :: ratio(:, :), decrement(:, :)

      call table%add(speed, self%speed, "rad/s", "angular speed of the shaft of &rotation", speed)
      call table%add("/frequency", self%frequency, "Hz", "frequency in ascending order", along)
      if (.not. allocated(self%eigenvalue)) return
      roots = [character(6) :: merge(mode, "/root", allocated(self%branch)), speed]
      call table%add("/eigenvalue", parts_of(self%eigenvalue), "1/s", "eigenvalue, imaginary part ascending", &
                     [character(8) :: "/complex", roots])
      call dampings(self%eigenvalue, ratio, decrement)
      call table%add("/damping_ratio", ratio, "1", "damping ratio of an eigenvalue", roots)
      call table%add("/logarithmic_decrement", decrement, "1", "logarithmic decrement of an eigenvalue", roots)
      if (allocated(self%verdict)) then
         call table%add("/stable", self%verdict, "1", "whether the motion of an eigenvalue decays", roots)
         call table%note_meanings(verdicts, verdict_words)
      end if
      if (.not. allocated(self%branch)) return
      call table%add("/branch", self%branch, "1", "number of the branch of an eigenvalue", along)
      call table%add("/direction", self%direction, "1", "direction of whirl: +1 forward, -1 backward", along)
   end subroutine speed_columns

   !> Damping ratio -Re λ/|λ| and logarithmic decrement -2π Re λ/Im λ (eigenvalues, speeds each); NaN where nothing vibrates.
   pure subroutine dampings(eigenvalue, ratio, decrement)
      complex(wp), intent(in) :: eigenvalue(:, :)
      real(wp), allocatable, intent(out) :: ratio(:, :), decrement(:, :)

      real(wp), allocatable :: modulus(:, :), omega(:, :)

      ! Comparisons with NaN would be invalid operations.
      modulus = merge(0.0_wp, abs(eigenvalue), ieee_is_nan(eigenvalue%re))
      omega = merge(0.0_wp, eigenvalue%im, ieee_is_nan(eigenvalue%re))
      allocate (ratio, decrement, mold=modulus)
      ratio = ieee_value(ratio, ieee_quiet_nan)
      decrement = ratio
      where (modulus > 0.0_wp) ratio = -eigenvalue%re/modulus
      where (omega > 0.0_wp) decrement = -2*pi*eigenvalue%re/omega
   end subroutine dampings

   subroutine critical_columns(self, table)
      class(modes_result_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: along = "/critical"

      call table%add("/critical_speed", self%critical%speed, "rad/s", "critical speed", along)
      call table%note("not_located", [self%lost])
      call table%add("/critical_order", self%critical%order, "1", "excitation frequency over that of rotation", along)
      call table%add("/critical_frequency", self%critical%frequency/(2*pi), "Hz", "frequency at the critical speed", along)
      call table%add("/critical_direction", self%critical%direction, "1", "direction of whirl: +1 forward, -1 backward", along)
      call table%add("/critical_branch", real(self%critical%branch, wp), "1", "branch at the critical speed", along)
      call table%add("/stability_limit", self%limit, "rad/s", "speed above which motion grows")
      call table%note("meaning", self%limit_words)
      if (len(self%limit_then) > 0) call table%note("then", self%limit_then(3:))
      call table%note("check", self%limit_check)
      call table%add("/stability_frequency", self%limit_frequency, "Hz", "frequency of the motion that grows from the limit on")
      call table%add("/undecided_from", self%undecided, "rad/s", "speed from which on stability is undecided")
   end subroutine critical_columns

   !> Meshes follow each other along one dimension of their own, the frequencies inside.
   subroutine reduction_columns(reduction, table)
      type(reduction_result_t), intent(in) :: reduction
      type(table_t), intent(inout) :: table

      character(*), parameter :: group = "/reduction/", kind = group//"kind", quantity = group//"quantity", mode = group//"mode", &
                                 hertz = group//"frequency_of_excitation", row = group//"mesh_and_frequency"
      character(*), parameter :: quantities(3) = [character(32) :: "static compliance", "frequencies of mesh modes", &
                                                                                                               "transfer function"]
      integer :: i, rows

      rows = size(reduction%true_response)
      call table%add(kind, reduction%name, "1", "kind of reduction", kind)
      call table%add(group//"coordinates", reduction%coordinates, "1", "coordinates of the reduced model", kind)
      call table%add(quantity, quantities, "1", "what is compared", quantity)
      call table%add(group//"error", reduction%error, "1", &
                     "largest error, relative; of the transfer function over its largest modulus", &
                     [character(24) :: quantity, kind])
      call table%add(group//"compliance", reduction%compliance, "m/N", "static compliance at the open mesh", &
                     [character(16) :: "/mesh", kind])
      call table%add(group//"unreduced_compliance", reduction%true_compliance, "m/N", "the same of the unreduced model", "/mesh")
      call table%add(mode, [(i, i=1, size(reduction%true_frequency))], "1", "number of the mode", mode)
      call table%add(group//"frequency", reduction%frequency, "Hz", &
                     "natural frequency with meshes closed, the nearest to the unreduced one", [mode, kind])
      call table%add(group//"unreduced_frequency", reduction%true_frequency, "Hz", &
                     "natural frequency of the unreduced model with meshes closed", mode)
      call table%add(group//"moves_mesh", reduction%moves, "1", "1 for a mode of the unreduced model that moves a mesh", mode)
      call table%add(hertz, reduction%hertz, "Hz", "frequency of a force in the mesh", hertz)
      call table%add(group//"response", parts_of(reshape(reduction%response, [rows, size(reduction%name)])), "m/N", &
                     "transfer function at the closed mesh, real and imaginary part", [character(32) :: "/complex", row, kind])
      call table%add(group//"unreduced_response", reshape(parts_of(reduction%true_response), [2, rows]), "m/N", &
                     "the same of the unreduced model", [character(32) :: "/complex", row])
   end subroutine reduction_columns

   !> The answer in lines.
   function words(content) result(lines)
      class(modes_result_t), intent(in) :: content
      type(string_t), allocatable :: lines(:)

      integer :: i

      allocate (lines(0))
      do i = 1, min(most_lines, size(content%natural))
         call append_text(lines, "mode "//to_text(i)//": "//decimal(content%natural(i), 3)//" Hz, "//nature(content, i))
      end do
      if (size(content%natural) > most_lines) call append_text(lines, "and "// &
                                                               counted(to_text(size(content%natural) - most_lines), "more mode"))
      if (allocated(content%free)) then
         if (len(content%free) > 0) call append_text(lines, content%free)
      end if
      if (allocated(content%verdict)) then
         if (.not. allocated(content%branch)) call append_dampings(lines, content)
         call append_neutral(lines, aimag(content%eigenvalue(:, 1)), content%verdict(:, 1))
      end if
      if (allocated(content%reduction)) call append_reduction(lines, content%reduction)
      if (allocated(content%critical)) call append_criticals(lines, content)
      if (allocated(content%response)) lines = [lines, content%response%words()]
   end function words

   !> Critical speeds and stability limit.
   subroutine append_criticals(lines, content)
      type(string_t), allocatable, intent(inout) :: lines(:)
      class(modes_result_t), intent(in) :: content

      integer :: i

      do i = 1, min(most_lines, size(content%critical))
         associate (one => content%critical(i))
            call append_text(lines, "critical speed of order "//to_text(one%order)//": "//decimal(one%speed, 3)//" rad/s = "// &
                             decimal(one%speed*30/pi, 2)//" rpm, "//decimal(one%frequency/(2*pi), 3)//" Hz, "// &
                             turning(one%direction))
         end associate
      end do
      if (size(content%critical) > most_lines) call append_text(lines, "and "// &
                                                       counted(to_text(size(content%critical) - most_lines), "more critical speed"))
      if (content%lost > 0) call append_text(lines, counted(to_text(content%lost), "critical speed")// &
                                             " not located: take more points")
      if (content%limit_words == "found") then
         call append_text(lines, "stability limit: "//decimal(content%limit, 3)//" rad/s = "// &
                          decimal(content%limit*30/pi, 2)//" rpm, "//decimal(content%limit_frequency, 3)//" Hz")
      else
         call append_text(lines, "stability limit: "//content%limit_words//content%limit_then)
      end if
      if (.not. ieee_is_nan(content%undecided)) then
         call append_text(lines, "undecided from "//decimal(content%undecided, 3)//" rad/s = "// &
                          decimal(content%undecided*30/pi, 2)//" rpm on: the error of an eigenvalue covers the bound")
      end if
   end subroutine append_criticals

   !> Frequencies and damping of a machine at rest, where anything damps it.
   subroutine append_dampings(lines, content)
      type(string_t), allocatable, intent(inout) :: lines(:)
      class(modes_result_t), intent(in) :: content

      real(wp), allocatable :: decrement(:, :), ratio(:, :)
      integer :: i, found

      call dampings(content%eigenvalue, ratio, decrement)
      found = 0
      do i = 1, size(decrement, 1)
         if (ieee_is_nan(decrement(i, 1)) .or. content%verdict(i, 1) == is_neutral) cycle
         found = found + 1
         if (found > most_lines) cycle
         call append_text(lines, "damped: "//decimal(content%eigenvalue(i, 1)%im/(2*pi), 3)//" Hz, damping ratio "// &
                          decimal(ratio(i, 1), 6)//", logarithmic decrement "//decimal(decrement(i, 1), 6)// &
                          trim(merge(", undecided", "           ", content%verdict(i, 1) == is_undecided)))
      end do
      if (found > most_lines) call append_text(lines, "and "//counted(to_text(found - most_lines), "more damped motion"))
   end subroutine append_dampings

   !> Frequencies of motions that nothing damps and nothing drives, at the first speed, without rigid ones, where others are damped
   !> or driven; `omega`, rad/s, and `verdict` are of all motions.
   subroutine append_neutral(lines, omega, verdict)
      type(string_t), allocatable, intent(inout) :: lines(:)
      real(wp), intent(in) :: omega(:)
      integer, intent(in) :: verdict(:)

      character(:), allocatable :: line
      integer :: i

      associate (shown => pack(omega, verdict == is_neutral .and. omega > 0.0_wp))
         if (size(shown) == 0 .or. all(verdict == is_neutral)) return
         line = "neutral, nothing damps or drives them:"
         do i = 1, min(most_lines, size(shown))
            line = line//" "//decimal(shown(i)/(2*pi), 3)
         end do
         if (size(shown) > most_lines) line = line//" and "//to_text(size(shown) - most_lines)//" more, in"
         call append_text(lines, line//" Hz")
      end associate
   end subroutine append_neutral

   !> The parts with a share in a mode, largest first, and the mesh.
   function nature(content, mode) result(text)
      type(modes_result_t), intent(in) :: content
      integer, intent(in) :: mode
      character(:), allocatable :: text

      real(wp) :: share(size(content%part))
      integer :: k, place

      share = content%share(:, mode)
      text = ""
      do k = 1, size(share)
         place = maxloc(share, dim=1)
         if (share(place) < named) exit
         if (len(text) > 0) text = text//", "
         text = text//trim(content%part(place))//" "//to_text(nint(100*share(place)))//" %"
         share(place) = 0.0_wp
      end do
      if (.not. allocated(content%strain_share)) return
      do k = 1, size(content%shaft)
         if (size(content%shaft) == 1 .or. content%shaft_share(k, mode) < named) cycle
         text = text//"; "//trim(content%shaft(k))//" "//to_text(nint(100*content%shaft_share(k, mode)))//" %"
      end do
      associate (mesh => content%strain_share(3, mode))
         if (mesh >= named) text = text//"; "//to_text(nint(100*mesh))//" % of the strain energy in the mesh"
      end associate
   end function nature

   !> The largest errors of reduced models.
   subroutine append_reduction(lines, reduction)
      type(string_t), allocatable, intent(inout) :: lines(:)
      type(reduction_result_t), intent(in) :: reduction

      integer :: i

      do i = 1, size(reduction%name)
         call append_text(lines, trim(reduction%name(i))//", "//counted(to_text(reduction%coordinates(i)), "coordinate")// &
                          ", errors against the unreduced model: static mesh compliance "//compliance()//", "// &
                          to_text(count(reduction%moves == 1))//" frequencies of modes that move the mesh "//percent(2)// &
                          ", transfer function at the mesh up to "//to_text(nint(maxval(reduction%hertz)))//" Hz "//percent(3))
      end do

   contains

      function compliance()
         character(:), allocatable :: compliance

         compliance = "none: the shaft is free to turn"
         if (.not. ieee_is_nan(reduction%error(1, i))) compliance = percent(1)
      end function compliance

      function percent(k)
         integer, intent(in) :: k
         character(:), allocatable :: percent

         percent = decimal(100*reduction%error(k, i), 4)//" %"
      end function percent

   end subroutine append_reduction

   pure function turning(direction) result(word)
      real(wp), intent(in) :: direction
      character(:), allocatable :: word

      word = "mixed whirl"
      if (abs(direction) < named) word = "no whirl"
      if (direction > round) word = "forward"
      if (direction < -round) word = "backward"
   end function turning

end module razy_study_modes_result
